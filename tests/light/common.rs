//! What the tests of lights share.

use glam::{DVec3, Mat3, Vec3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use smithwalk::embree::Ray;
use smithwalk::light::{
    AreaLight, Bulb, EmissiveTriangle, Light, Lights, Outline, PointLight, Receiver, Shape, World,
};
use smithwalk::rays::{RayKind, RayKinds};
use std::f32::consts::PI;

/// The bound of every z-test. One test in 1.7 million is a false alarm; there
/// are about a hundred, so that the whole file raises one in 17 000 runs with
/// fresh seeds. Seeds are fixed.
pub const SIGMAS: f64 = 5.0;

/// What single precision may add, relative.
pub const ROUNDING: f64 = 3e-5;

pub fn rng(seed: u64) -> Pcg64 {
    Pcg64::seed_from_u64(seed)
}

pub fn pair(rng: &mut Pcg64) -> [f32; 2] {
    [rng.random(), rng.random()]
}

pub fn direction(rng: &mut Pcg64) -> Vec3 {
    let [a, b] = pair(rng);
    let z = 1.0 - 2.0 * a;
    let (sin, cos) = (2.0 * PI * b).sin_cos();
    let r = (1.0 - z * z).max(0.0).sqrt();
    Vec3::new(r * cos, r * sin, z).normalize()
}

pub fn black() -> World {
    World::Constant(Vec3::ZERO)
}

pub fn lamps(shapes: impl IntoIterator<Item = Shape>) -> Lights {
    let lamps = shapes
        .into_iter()
        .map(|shape| Light {
            shape,
            seen_by: RayKinds::ALL,
        })
        .collect();
    Lights::new(lamps, black(), Vec::new())
}

pub fn area(center: Vec3, outline: Outline, size: [f32; 2], radiance: f32) -> Shape {
    let light = AreaLight::new(
        center,
        Mat3::IDENTITY,
        outline,
        size,
        Vec3::splat(radiance),
        PI,
    );
    Shape::Area(light.expect("an area"))
}

pub fn bulb(position: Vec3, intensity: f32, bulb: Bulb) -> Shape {
    Shape::Point(PointLight::new(
        position,
        Vec3::splat(intensity),
        bulb,
        None,
    ))
}

/// Two triangles that make the rectangle of [`area`].
pub fn quad(center: Vec3, size: [f32; 2], radiance: f32) -> Vec<EmissiveTriangle> {
    let [x, y] = [Vec3::X * size[0] / 2.0, Vec3::Y * size[1] / 2.0];
    let corners = [-x - y, x - y, x + y, -x + y].map(|corner| center + corner);
    [[0, 1, 2], [0, 2, 3]]
        .map(|indices| EmissiveTriangle {
            vertices: indices.map(|i| corners[i]),
            radiance: Vec3::splat(radiance),
        })
        .to_vec()
}

/// A mean and its standard error.
#[derive(Clone, Copy, Debug)]
pub struct Estimate {
    pub mean: f64,
    pub error: f64,
}

impl Estimate {
    pub fn of(n: usize, mut draw: impl FnMut() -> f64) -> Self {
        let (mut mean, mut squares) = (0.0, 0.0);
        for i in 1..=n {
            let x = draw();
            let delta = x - mean;
            mean += delta / i as f64;
            squares += delta * (x - mean);
        }
        Self {
            mean,
            error: (squares / (n - 1) as f64 / n as f64).sqrt(),
        }
    }

    /// `name` says what, should it fail.
    #[track_caller]
    pub fn assert_is(self, expected: f64, name: &str) {
        let bound = SIGMAS * self.error + ROUNDING * expected.abs();
        assert!(
            (self.mean - expected).abs() <= bound,
            "{name}: {self:?}, expected {expected}"
        );
        // A test that passes on noise alone proves nothing.
        assert!(
            self.error <= 0.02 * expected.abs(),
            "{name}: too noisy, {self:?}"
        );
    }
}

/// The irradiance on the side of `normal` by light samples, W·m⁻².
pub fn irradiance(
    lights: &Lights,
    at: impl Into<Receiver>,
    normal: Vec3,
    n: usize,
    seed: u64,
) -> Estimate {
    let at = at.into();
    let mut rng = rng(seed);
    Estimate::of(n, || {
        let u_select = rng.random();
        let u = pair(&mut rng);
        lights.sample(at, u_select, u).map_or(0.0, |sample| {
            let cos = f64::from(sample.direction.dot(normal).max(0.0));
            f64::from(sample.radiance.x) * cos / f64::from(sample.pdf)
        })
    })
}

/// Every sample that isn't of a delta light is met again by a ray, with the
/// same radiance and the same density.
#[track_caller]
pub fn check_crossings(lights: &Lights, p: Vec3, n: usize, seed: u64, tolerance: f32) {
    let mut rng = rng(seed);
    let (mut found, mut lost) = (0, 0);
    for _ in 0..n {
        let u_select = rng.random();
        let Some(sample) = lights.sample(p, u_select, pair(&mut rng)) else {
            continue;
        };
        assert!(!sample.delta);
        let mut ray = Ray::new(p, sample.direction);
        if sample.distance.is_finite() {
            ray.t_far = sample.distance * 1.01;
        }
        let mut met = false;
        lights.crossed(&ray, None, RayKind::Diffuse, |radiance, pdf, _| {
            met |= (radiance - sample.radiance).length() <= tolerance * sample.radiance.length()
                && (pdf / sample.pdf - 1.0).abs() <= tolerance;
        });
        found += usize::from(met);
        lost += usize::from(!met);
    }
    // Samples on the very rim may be missed through rounding.
    assert!(found > n / 4, "only {found} of {n} samples");
    assert!(
        lost * 1000 <= found,
        "{lost} of {} are not met again",
        found + lost
    );
}

/// ∫ pdf dω over what rays from `p` meet, by uniform directions.
pub fn total_density(lights: &Lights, p: Vec3, n: usize, seed: u64) -> Estimate {
    let mut rng = rng(seed);
    Estimate::of(n, || {
        let ray = Ray::new(p, direction(&mut rng));
        let mut sum = 0.0;
        lights.crossed(&ray, None, RayKind::Diffuse, |_, pdf, _| {
            sum += f64::from(pdf)
        });
        sum * 4.0 * std::f64::consts::PI
    })
}

/// The irradiance of a polygon of radiance 1 above the horizon, by Lambert's
/// formula (1760): the sum over edges of the angle times the cosine of the
/// edge plane's normal, over 2. Corners as seen from the shading point.
pub fn lambert(corners: &[DVec3], normal: DVec3) -> f64 {
    let n = corners.len();
    let sum: f64 = (0..n)
        .map(|i| {
            let (a, b) = (corners[i].normalize(), corners[(i + 1) % n].normalize());
            let cross = a.cross(b);
            let angle = cross.length().atan2(a.dot(b));
            angle * cross.normalize().dot(normal)
        })
        .sum();
    sum.abs() / 2.0
}

/// The corners of the rectangle of [`area`] as seen from `p`.
pub fn corners(center: Vec3, size: [f32; 2], p: Vec3) -> [DVec3; 4] {
    let c = center.as_dvec3() - p.as_dvec3();
    let [x, y] = [
        DVec3::X * f64::from(size[0]) / 2.0,
        DVec3::Y * f64::from(size[1]) / 2.0,
    ];
    [c - x - y, c + x - y, c + x + y, c - x + y]
}
