//! What is measured: a microsurface of whichever distribution and facets.

use std::sync::Arc;

use rand_pcg::Pcg64Mcg;
use smithwalk_model::layered::Layered;
use smithwalk_model::{
    Estimator, Exit, Facets, Microsurface, Ndf, NormalTable, PerOrder, Rgb, Split, Stream,
    Tabulated, Total, Vector3,
};

/// The generator that each point has one of.
pub type Rng = Stream<Pcg64Mcg>;

/// How f is estimated.
#[derive(Clone, Copy)]
pub enum Method {
    /// All orders.
    Orders(Estimator),
    /// The first order alone.
    Single,
}

/// A microsurface seen from above, of whichever distribution and facets.
pub trait Scatter: Send + Sync {
    /// One estimate of f |cosθ_o|, sr⁻¹, all orders together.
    fn eval(&self, method: Method, wi: Vector3<f64>, wo: Vector3<f64>, rng: &mut Rng) -> Rgb<f64>;
    /// The same, order by order, added to `orders`.
    fn eval_orders(
        &self,
        estimator: Estimator,
        wi: Vector3<f64>,
        wo: Vector3<f64>,
        rng: &mut Rng,
        orders: &mut PerOrder<f64>,
    );
    /// One walk.
    fn sample(&self, wi: Vector3<f64>, rng: &mut Rng) -> Option<Exit<f64>>;
    /// The proxy density, sr⁻¹.
    fn pdf(&self, wi: Vector3<f64>, wo: Vector3<f64>) -> f64;
}

impl<N, I> Scatter for Microsurface<N, I>
where
    N: Ndf<Scalar = f64> + Send + Sync,
    I: Facets<Scalar = f64> + Send + Sync,
{
    fn eval(&self, method: Method, wi: Vector3<f64>, wo: Vector3<f64>, rng: &mut Rng) -> Rgb<f64> {
        match method {
            Method::Single => self.eval_single(wi, wo, rng),
            Method::Orders(estimator) => {
                let mut total = Total::default();
                Microsurface::eval(self, estimator, wi, wo, rng, &mut total);
                total.0
            }
        }
    }

    fn eval_orders(
        &self,
        estimator: Estimator,
        wi: Vector3<f64>,
        wo: Vector3<f64>,
        rng: &mut Rng,
        orders: &mut PerOrder<f64>,
    ) {
        Microsurface::eval(self, estimator, wi, wo, rng, orders);
    }

    fn sample(&self, wi: Vector3<f64>, rng: &mut Rng) -> Option<Exit<f64>> {
        Microsurface::sample(self, wi, rng)
    }

    fn pdf(&self, wi: Vector3<f64>, wo: Vector3<f64>) -> f64 {
        Microsurface::pdf(self, wi, wo)
    }
}

/// A microsurface whose normals are from a table, which it owns.
struct OfTable<I> {
    table: Arc<NormalTable>,
    facets: I,
}

impl<I: Facets<Scalar = f64>> OfTable<I> {
    fn surface(&self) -> Microsurface<Tabulated<'_, f64>, I> {
        Microsurface {
            ndf: self.table.normals(),
            facets: self.facets,
        }
    }
}

impl<I: Facets<Scalar = f64> + Send + Sync> Scatter for OfTable<I> {
    fn eval(&self, method: Method, wi: Vector3<f64>, wo: Vector3<f64>, rng: &mut Rng) -> Rgb<f64> {
        Scatter::eval(&self.surface(), method, wi, wo, rng)
    }

    fn eval_orders(
        &self,
        estimator: Estimator,
        wi: Vector3<f64>,
        wo: Vector3<f64>,
        rng: &mut Rng,
        orders: &mut PerOrder<f64>,
    ) {
        Scatter::eval_orders(&self.surface(), estimator, wi, wo, rng, orders);
    }

    fn sample(&self, wi: Vector3<f64>, rng: &mut Rng) -> Option<Exit<f64>> {
        Scatter::sample(&self.surface(), wi, rng)
    }

    fn pdf(&self, wi: Vector3<f64>, wo: Vector3<f64>) -> f64 {
        Scatter::pdf(&self.surface(), wi, wo)
    }
}

/// A stack that is seen from above or, with z turned, from below.
struct Stack {
    layers: Layered<f64>,
    below: bool,
}

impl Stack {
    fn upright(&self, v: Vector3<f64>) -> Vector3<f64> {
        if self.below {
            Vector3::new(v.x, v.y, -v.z)
        } else {
            v
        }
    }
}

impl Scatter for Stack {
    fn eval(&self, method: Method, wi: Vector3<f64>, wo: Vector3<f64>, rng: &mut Rng) -> Rgb<f64> {
        let (wi, wo) = (self.upright(wi), self.upright(wo));
        let mut split = Split::default();
        self.layers.eval(wi, wo, rng, &mut split);
        match method {
            Method::Single => split.single,
            Method::Orders(_) => split.total(),
        }
    }

    fn eval_orders(
        &self,
        _: Estimator,
        wi: Vector3<f64>,
        wo: Vector3<f64>,
        rng: &mut Rng,
        orders: &mut PerOrder<f64>,
    ) {
        let (wi, wo) = (self.upright(wi), self.upright(wo));
        self.layers.eval(wi, wo, rng, orders);
    }

    fn sample(&self, wi: Vector3<f64>, rng: &mut Rng) -> Option<Exit<f64>> {
        let exit = self.layers.sample(self.upright(wi), rng)?;
        Some(Exit {
            direction: self.upright(exit.direction),
            weight: exit.weight,
            order: exit.order,
        })
    }

    fn pdf(&self, wi: Vector3<f64>, wo: Vector3<f64>) -> f64 {
        self.layers.pdf(self.upright(wi), self.upright(wo))
    }
}

/// A surface from its two sides.
pub struct Sides {
    above: Box<dyn Scatter>,
    /// Absent where nothing comes through.
    below: Option<Box<dyn Scatter>>,
}

impl Sides {
    pub fn of<N, I>(ndf: N, facets: I) -> Self
    where
        N: Ndf<Scalar = f64> + Send + Sync + 'static,
        I: Facets<Scalar = f64> + Send + Sync + 'static,
    {
        Self {
            above: Box::new(Microsurface { ndf, facets }),
            below: I::TRANSMITS.then(|| {
                let facets = facets.inverted();
                Box::new(Microsurface { ndf, facets }) as Box<dyn Scatter>
            }),
        }
    }

    /// A microsurface whose normals are from a table.
    pub fn of_table<I>(table: NormalTable, facets: I) -> Self
    where
        I: Facets<Scalar = f64> + Send + Sync + 'static,
    {
        let table = Arc::new(table);
        let seen = |facets| -> Box<dyn Scatter> {
            let table = Arc::clone(&table);
            Box::new(OfTable { table, facets })
        };
        Self {
            above: seen(facets),
            below: I::TRANSMITS.then(|| seen(facets.inverted())),
        }
    }

    /// A stack of layers.
    pub fn layered(layers: Layered<f64>) -> Self {
        let seen = |below| {
            let layers = layers.clone();
            Box::new(Stack { layers, below }) as Box<dyn Scatter>
        };
        Self {
            above: seen(false),
            below: layers.is_open().then(|| seen(true)),
        }
    }

    /// The surface as `wi` sees it, and whether that is from below: then z is
    /// mirrored. Light on the opaque side meets nothing.
    pub fn seen_from(&self, wi: Vector3<f64>) -> Option<(&dyn Scatter, bool)> {
        if wi.z > 0.0 {
            Some((&*self.above, false))
        } else {
            self.below.as_deref().map(|below| (below, true))
        }
    }
}
