//! Tensor files of measured materials (Dupuy and Jakob 2018, "An Adaptive
//! Parameterization for Efficient Material Acquisition and Rendering"), as Mitsuba's
//! `measured` reads them.
//!
//! Stored is f cosθ_o · 4σ(ω_i)/D(m) over the square that visible normals m of a
//! distribution D are warped to. Any D will do; this is GGX of a roughness near that
//! of the material, so that what is interpolated varies little.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::TableError;
use super::estimate::{Source, spherical};
use super::warp::Warp;
use smithwalk_model::{Draw, Ggx, Ndf, Vector3};

/// How fine a file is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rgl {
    /// Polar angles of ω_i, from 0 to 90° (≥ 2).
    pub theta_i: usize,
    /// Points along each side of the square (≥ 2).
    pub side: usize,
}

/// Points of D and σ over √θ.
const FINE: usize = 256;

/// Points of the visible normals over √θ_m and φ_m.
const NORMALS: usize = 129;

/// The share of an even density beside that of visible normals: without it there are
/// points of the square where the warp has no inverse.
const EVEN: f64 = 1e-3;

/// What 90° is taken for: at the horizon itself nothing is defined.
const GRAZING: f64 = FRAC_PI_2 - 1e-3;

/// Walks that the roughness is found from.
const WALKS: usize = 1 << 14;

/// The file.
///
/// # Errors
/// If light goes through.
pub fn rgl(source: &Source<'_>, size: Rgl, description: &str) -> Result<Vec<u8>, TableError> {
    if source.transmits() {
        return Err(TableError::Transmits);
    }
    let Rgl { theta_i, side } = size;
    let normals = Normals(Ggx::isotropic(width(source)));
    let angles: Vec<f64> = (0..theta_i)
        .map(|i| FRAC_PI_2 * i as f64 / (theta_i - 1) as f64)
        .collect();
    let fine = |of: &dyn Fn(f64) -> f64| -> Vec<f32> {
        let line = (0..FINE).map(|i| of(i as f64 / (FINE - 1) as f64) as f32);
        line.clone().chain(line).collect()
    };
    let ndf = fine(&|u| normals.density(u));
    let sigma = fine(&|u| normals.area(polar(u)));
    let visible: Vec<Vec<f64>> = angles.par_iter().map(|&a| normals.visible(a)).collect();
    let points: Vec<[f32; 3]> = (0..theta_i * side * side)
        .into_par_iter()
        .map_init(
            || None,
            |known: &mut Option<(usize, Warp)>, index| {
                let slice = index / (side * side);
                if known.as_ref().is_none_or(|(of, _)| *of != slice) {
                    *known = Some((slice, Warp::new(NORMALS, visible[slice].clone())));
                }
                let warp = &known.as_ref().expect("just made").1;
                let at = |i: usize| i as f64 / (side - 1) as f64;
                let [u, v] = warp.sample([at(index % side), at(index / side % side)]);
                let theta = angles[slice].min(GRAZING);
                let wi = spherical(theta, 0.0);
                let m = spherical(polar(u), (2.0 * v - 1.0) * PI);
                let wo = mirrored(wi, m);
                if wo.z <= 0.0 {
                    return [0.0; 3];
                }
                let area = interpolated(&sigma[..FINE], root(angles[slice]));
                let scale = 4.0 * area / interpolated(&ndf[..FINE], u);
                let found = source.scattered(wi, wo, 2, index as u64);
                found.value.map(|x| (x * scale) as f32)
            },
        )
        .collect();

    let mut channels = vec![0.0; 3 * points.len()];
    let mut luminance = vec![0.0; points.len()];
    for (index, value) in points.iter().enumerate() {
        let (slice, place) = (index / (side * side), index % (side * side));
        for (c, &x) in value.iter().enumerate() {
            channels[(3 * slice + c) * side * side + place] = x;
        }
        luminance[index] = 0.2126 * value[0] + 0.7152 * value[1] + 0.0722 * value[2];
    }
    let angles: Vec<f32> = angles.iter().map(|&a| a as f32).collect();
    let visible: Vec<f32> = visible.concat().iter().map(|&x| x as f32).collect();
    Ok(tensors(&[
        Tensor::bytes("description", description.as_bytes()),
        Tensor::bytes("jacobian", &[1]),
        Tensor::floats("phi_i", &[1], &[0.0]),
        Tensor::floats("theta_i", &[theta_i], &angles),
        Tensor::floats("ndf", &[2, FINE], &ndf),
        Tensor::floats("sigma", &[2, FINE], &sigma),
        Tensor::floats("vndf", &[1, theta_i, NORMALS, NORMALS], &visible),
        Tensor::floats("luminance", &[1, theta_i, side, side], &luminance),
        Tensor::floats("rgb", &[1, theta_i, 3, side, side], &channels),
    ]))
}

/// θ of the format's u = √(2θ/π).
fn polar(u: f64) -> f64 {
    FRAC_PI_2 * u * u
}

/// u of θ.
fn root(theta: f64) -> f64 {
    (theta / FRAC_PI_2).sqrt()
}

fn mirrored(w: Vec3, m: Vec3) -> Vec3 {
    let (w, m) = (w.as_dvec3(), m.as_dvec3());
    (2.0 * w.dot(m) * m - w).normalize().as_vec3()
}

/// A table over [0, 1], linear between its points.
fn interpolated(table: &[f32], u: f64) -> f64 {
    let place = u * (table.len() - 1) as f64;
    let index = (place as usize).min(table.len() - 2);
    let (a, b) = (f64::from(table[index]), f64::from(table[index + 1]));
    a + (place - index as f64) * (b - a)
}

/// The distribution of a file.
struct Normals(Ggx<f64>);

impl Normals {
    /// D(m), sr⁻¹, over u.
    fn density(&self, u: f64) -> f64 {
        // At the horizon D is taken for what it is beside it.
        self.0
            .density(Vector3::spherical(polar(u).cos().max(1e-9), 0.0))
    }

    /// σ, without a unit.
    fn area(&self, theta: f64) -> f64 {
        self.0.projected_area(Vector3::spherical(theta.cos(), 0.0))
    }

    /// The density of visible normals seen from `theta`, over the square of u (right)
    /// and φ/2π + 1/2 (down).
    fn visible(&self, theta: f64) -> Vec<f64> {
        let w = DVec3::new(theta.sin(), 0.0, theta.cos());
        let area = self.area(theta);
        let at = |i: usize| i as f64 / (NORMALS - 1) as f64;
        let value = |index: usize| {
            let (u, phi) = (at(index % NORMALS), (2.0 * at(index / NORMALS) - 1.0) * PI);
            let (sin, cos) = polar(u).sin_cos();
            let facing = w.dot(DVec3::new(sin * phi.cos(), sin * phi.sin(), cos));
            let density = facing.max(0.0) * self.density(u) / area;
            // dm = sinθ dθ dφ, dθ = πu du, dφ = 2π dv.
            (1.0 - EVEN) * density * 2.0 * PI * PI * u * sin + EVEN
        };
        (0..NORMALS * NORMALS).map(value).collect()
    }
}

/// The α of GGX whose normals, seen from straight above, have the median slope that
/// the material's half vectors have: of visible normals half are flatter than α.
fn width(source: &Source<'_>) -> f64 {
    let bsdf = source.seen_from(Vec3::Z);
    let mut rng = source.rng(3, 0);
    let mut slopes: Vec<f64> = (0..WALKS)
        .filter_map(|_| {
            let choice = rng.draw();
            let sample = bsdf.sample(Vec3::Z, choice, &mut rng)?;
            let half = (sample.wi + Vec3::Z).as_dvec3();
            Some(half.truncate().length() / half.z)
        })
        .collect();
    slopes.sort_unstable_by(f64::total_cmp);
    let median = slopes.get(slopes.len() / 2).copied().unwrap_or(1.0);
    median.clamp(0.01, 1.0)
}

/// A field of a tensor file.
struct Tensor {
    name: &'static str,
    kind: u8,
    shape: Vec<usize>,
    data: Vec<u8>,
}

impl Tensor {
    fn bytes(name: &'static str, data: &[u8]) -> Self {
        Self {
            name,
            kind: 1,
            shape: vec![data.len()],
            data: data.to_vec(),
        }
    }

    fn floats(name: &'static str, shape: &[usize], data: &[f32]) -> Self {
        assert_eq!(shape.iter().product::<usize>(), data.len(), "{name}");
        Self {
            name,
            kind: 10,
            shape: shape.to_vec(),
            data: data.iter().flat_map(|x| x.to_le_bytes()).collect(),
        }
    }

    /// Bytes of its entry in the list of fields.
    fn entry(&self) -> usize {
        2 + self.name.len() + 2 + 1 + 8 + 8 * self.shape.len()
    }
}

/// A tensor file of version 1.0, little-endian: the list of fields, then their data,
/// each at a multiple of eight bytes.
fn tensors(fields: &[Tensor]) -> Vec<u8> {
    let mut file = b"tensor_file\0\x01\x00".to_vec();
    file.extend((fields.len() as u32).to_le_bytes());
    let mut place = file.len() + fields.iter().map(Tensor::entry).sum::<usize>();
    for field in fields {
        place = place.next_multiple_of(8);
        file.extend((field.name.len() as u16).to_le_bytes());
        file.extend(field.name.as_bytes());
        file.extend((field.shape.len() as u16).to_le_bytes());
        file.push(field.kind);
        file.extend((place as u64).to_le_bytes());
        file.extend(field.shape.iter().flat_map(|&n| (n as u64).to_le_bytes()));
        place += field.data.len();
    }
    for field in fields {
        file.resize(file.len().next_multiple_of(8), 0);
        file.extend(&field.data);
    }
    file
}
