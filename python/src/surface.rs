//! Surfaces as Python makes them: every distribution with every kind of facet.

use numpy::ndarray::{Array1, Array2, Array3};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArray3, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use smithwalk_model::layered::{Base, Finish, Interface, Layered};
use smithwalk_model::{
    Beckmann, Conductor, ConductorFresnel, Dielectric, Diffuse, Estimator, Facets, Ggx,
    NormalTable, Quadratic, Rgb, StudentT, Vector3,
};

use crate::measure::{self, Albedo, Directions};
use crate::scatter::{Method, Sides};

/// A rough surface.
#[pyclass(frozen)]
pub struct Surface(Sides);

/// A distribution of normals: its name, α_x and α_y, and γ for Student's.
type Normals<'a> = (&'a str, [f64; 2], f64);

/// Edges, radians from the normal, and densities of a table, which is no name's.
type Rings = Option<(Vec<f64>, Vec<f64>)>;

fn with<I>((distribution, alpha, gamma): Normals<'_>, rings: Rings, facets: I) -> PyResult<Surface>
where
    I: Facets<Scalar = f64> + Send + Sync + 'static,
{
    if let Some((edges, densities)) = rings {
        let table = NormalTable::new(&edges, &densities);
        let table = table.map_err(|error| PyValueError::new_err(format!("table: {error}")))?;
        return Ok(Surface(Sides::of_table(table, facets)));
    }
    let [alpha_x, alpha_y] = alpha;
    let sides = match distribution {
        "ggx" => Sides::of(Ggx { alpha_x, alpha_y }, facets),
        "beckmann" => Sides::of(Beckmann { alpha_x, alpha_y }, facets),
        "quadratic" => Sides::of(Quadratic::new(), facets),
        "student-t" => {
            let ndf = StudentT {
                alpha_x,
                alpha_y,
                gamma,
            };
            Sides::of(ndf, facets)
        }
        other => {
            return Err(PyValueError::new_err(format!(
                "distribution: expected 'ggx', 'beckmann', 'student-t' or 'quadratic', found {other:?}"
            )));
        }
    };
    Ok(Surface(sides))
}

/// An interface: the index below, its normals, and absorption and thickness of
/// the slab below.
type Layer = (f64, OwnedNormals, [f64; 3], f64);

/// A base: its facets, its normals, and colour or η and k.
type Bottom = (String, OwnedNormals, [f64; 3], [f64; 3]);

/// [`Normals`] that lists can hold.
type OwnedNormals = (String, [f64; 2], f64);

fn finish((distribution, [alpha_x, alpha_y], _): OwnedNormals) -> PyResult<Finish<f64>> {
    Ok(match distribution.as_str() {
        "ggx" => Finish::Ggx(Ggx { alpha_x, alpha_y }),
        "beckmann" => Finish::Beckmann(Beckmann { alpha_x, alpha_y }),
        other => {
            return Err(PyValueError::new_err(format!(
                "distribution: layers have 'ggx' and 'beckmann', found {other:?}"
            )));
        }
    })
}

fn base(bottom: Option<Bottom>) -> PyResult<Base<f64>> {
    let Some((facets, normals, first, second)) = bottom else {
        return Ok(Base::Open);
    };
    let finish = finish(normals)?;
    let fresnel = match facets.as_str() {
        "diffuse" => {
            let albedo = Rgb(first);
            return Ok(Base::Diffuse { finish, albedo });
        }
        "color" => ConductorFresnel::Constant(Rgb(first)),
        _ => ConductorFresnel::Complex {
            eta: Rgb(first),
            k: Rgb(second),
        },
    };
    Ok(Base::Conductor { finish, fresnel })
}

fn method(name: &str) -> PyResult<Method> {
    Ok(match name {
        "auto" | "position-free" => Method::Orders(Estimator::PositionFree),
        "two-walk" => Method::Orders(Estimator::TwoWalk),
        "walk" => Method::Orders(Estimator::Walk),
        "single" => Method::Single,
        other => {
            return Err(PyValueError::new_err(format!(
                "estimator: expected 'auto', 'position-free', 'two-walk', 'walk' or 'single', found {other:?}"
            )));
        }
    })
}

type Columns<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>);
type Blocks<'py> = (Bound<'py, PyArray3<f64>>, Bound<'py, PyArray3<f64>>);
type Samples<'py> = (
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray1<u32>>,
);

fn rows<'py>(py: Python<'py>, found: Vec<[f64; 3]>) -> Bound<'py, PyArray2<f64>> {
    let rows = Array2::from_shape_vec((found.len(), 3), found.into_flattened());
    rows.expect("three numbers each").into_pyarray(py)
}

fn columns<'py>(py: Python<'py>, found: impl Iterator<Item = measure::Estimate>) -> Columns<'py> {
    let (means, errors) = found.map(|e| (e.mean, e.standard_error)).unzip();
    (rows(py, means), rows(py, errors))
}

#[pymethods]
impl Surface {
    #[staticmethod]
    fn conductor_color(normals: Normals<'_>, rings: Rings, color: [f64; 3]) -> PyResult<Self> {
        let fresnel = ConductorFresnel::Constant(Rgb(color));
        with(normals, rings, Conductor { fresnel })
    }

    #[staticmethod]
    fn conductor_complex(
        normals: Normals<'_>,
        rings: Rings,
        eta: [f64; 3],
        k: [f64; 3],
    ) -> PyResult<Self> {
        let fresnel = ConductorFresnel::Complex {
            eta: Rgb(eta),
            k: Rgb(k),
        };
        with(normals, rings, Conductor { fresnel })
    }

    #[staticmethod]
    fn dielectric(normals: Normals<'_>, rings: Rings, eta: f64, tint: [f64; 3]) -> PyResult<Self> {
        let tint = Rgb(tint);
        with(normals, rings, Dielectric { eta, tint })
    }

    #[staticmethod]
    fn diffuse(normals: Normals<'_>, rings: Rings, albedo: [f64; 3]) -> PyResult<Self> {
        let albedo = Rgb(albedo);
        with(normals, rings, Diffuse { albedo })
    }

    #[staticmethod]
    fn layered(interfaces: Vec<Layer>, bottom: Option<Bottom>) -> PyResult<Self> {
        let interfaces = interfaces
            .into_iter()
            .map(|(ior, normals, absorption, thickness)| {
                Ok(Interface {
                    absorption: Rgb(absorption),
                    thickness,
                    ..Interface::new(ior, finish(normals)?)
                })
            })
            .collect::<PyResult<Vec<_>>>()?;
        let layers = Layered::new(&interfaces, base(bottom)?);
        let layers = layers.map_err(|error| PyValueError::new_err(error.to_string()))?;
        Ok(Self(Sides::layered(layers)))
    }

    fn eval<'py>(
        &self,
        py: Python<'py>,
        wi: PyReadonlyArray2<'py, f64>,
        wo: PyReadonlyArray2<'py, f64>,
        estimator: &str,
        samples: u64,
        seed: u64,
    ) -> PyResult<Columns<'py>> {
        let method = method(estimator)?;
        let (wi, wo) = (Directions(wi.as_slice()?), Directions(wo.as_slice()?));
        let (means, errors) = py.detach(|| measure::eval(&self.0, method, wi, wo, samples, seed));
        Ok((rows(py, means), rows(py, errors)))
    }

    #[allow(clippy::too_many_arguments)] // as Python calls it
    fn eval_orders<'py>(
        &self,
        py: Python<'py>,
        wi: PyReadonlyArray2<'py, f64>,
        wo: PyReadonlyArray2<'py, f64>,
        estimator: &str,
        orders: usize,
        samples: u64,
        seed: u64,
    ) -> PyResult<Blocks<'py>> {
        let Method::Orders(estimator) = method(estimator)? else {
            return Err(PyValueError::new_err(
                "estimator: 'single' has one order; use eval",
            ));
        };
        let (wi, wo) = (Directions(wi.as_slice()?), Directions(wo.as_slice()?));
        let found =
            py.detach(|| measure::eval_orders(&self.0, estimator, wi, wo, orders, samples, seed));
        let array = |value: fn(&measure::Estimate) -> [f64; 3]| {
            let flat: Vec<f64> = found.iter().flatten().flat_map(value).collect();
            let blocks = Array3::from_shape_vec((wi.len(), orders, 3), flat);
            blocks.expect("three channels each").into_pyarray(py)
        };
        Ok((array(|e| e.mean), array(|e| e.standard_error)))
    }

    fn sample<'py>(
        &self,
        py: Python<'py>,
        wi: PyReadonlyArray2<'py, f64>,
        seed: u64,
    ) -> PyResult<Samples<'py>> {
        let wi = Directions(wi.as_slice()?);
        let found = py.detach(|| measure::sample(&self.0, wi, seed));
        let orders: Array1<u32> = found.iter().map(|s| s.order).collect();
        let (directions, weights) = found.iter().map(|s| (s.direction, s.weight)).unzip();
        Ok((
            rows(py, directions),
            rows(py, weights),
            orders.into_pyarray(py),
        ))
    }

    fn pdf<'py>(
        &self,
        py: Python<'py>,
        wi: PyReadonlyArray2<'py, f64>,
        wo: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let (wi, wo) = (Directions(wi.as_slice()?), Directions(wo.as_slice()?));
        let found = py.detach(|| measure::pdf(&self.0, wi, wo));
        Ok(Array1::from_vec(found).into_pyarray(py))
    }

    /// Reflected and transmitted shares with their standard errors, the share
    /// of each order, and the mean order, of walks from each direction.
    #[allow(clippy::type_complexity)] // six columns, named on the other side
    fn albedo<'py>(
        &self,
        py: Python<'py>,
        wi: PyReadonlyArray2<'py, f64>,
        orders: usize,
        samples: u64,
        seed: u64,
    ) -> PyResult<(
        Columns<'py>,
        Columns<'py>,
        Bound<'py, PyArray2<f64>>,
        Bound<'py, PyArray1<f64>>,
    )> {
        let wi = Directions(wi.as_slice()?);
        let found = py.detach(|| measure::albedo(&self.0, wi, orders, samples, seed));
        let side = |side: fn(&Albedo) -> measure::Estimate| columns(py, found.iter().map(side));
        let shares: Vec<f64> = found.iter().flat_map(|a| a.orders.clone()).collect();
        let shares = Array2::from_shape_vec((found.len(), orders), shares);
        let mean: Array1<f64> = found.iter().map(|a| a.mean_order).collect();
        Ok((
            side(|a| a.reflected),
            side(|a| a.transmitted),
            shares.expect("all have as many orders").into_pyarray(py),
            mean.into_pyarray(py),
        ))
    }

    /// Walks from `wi`, binned by direction: mean weight and standard error of
    /// each bin, (cosines × azimuths) × 3.
    fn lobe<'py>(
        &self,
        py: Python<'py>,
        wi: [f64; 3],
        bins: [usize; 2],
        samples: u64,
        seed: u64,
    ) -> Columns<'py> {
        let wi = Vector3::new(wi[0], wi[1], wi[2]);
        let found = py.detach(|| measure::lobe(&self.0, wi, bins, samples, seed));
        columns(py, found.into_iter())
    }
}
