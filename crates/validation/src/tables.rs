//! The released tables of `docs/tables`: what becomes of the light on rough surfaces, by
//! scattering order.
//!
//! Facets are white: one that keeps the share c of the light at any angle weighs order n
//! by cⁿ, so that albedos of any constant reflectance follow. Each value is the mean over
//! [`REPLICATES`] scrambled Sobol sets of walks, from whose scatter its standard error
//! comes; there are as many walks as all errors of a case need to be as small as asked.
//!
//! The walks are not those of [`smithwalk_model`]: they never leave. At every facet the
//! chance to leave is counted and the rest of the light goes on, along both ways where it
//! is divided, as long as there is much of it.

use std::f64::consts::LN_2;

use rayon::prelude::*;
use smithwalk_model::{
    Beckmann, Conductor, ConductorFresnel, Dielectric, Diffuse, Draw, Facets, Ggx, Ndf, Rgb, Side,
    Vector3, fresnel,
};

use crate::model::Distribution;
use crate::points::{REPLICATES, Sobol, replicated_many};
use crate::statistics::Mean;

/// Walks of each scrambled set, at first and at most.
const POINTS: [u32; 2] = [1 << 10, 1 << 18];

/// Orders with a column of their own; the last has the rest as well.
pub const ORDERS: usize = 8;

/// Reflectances of which conductors and diffuse facets have an albedo in the tables.
pub const REFLECTANCES: [f64; 3] = [0.5, 0.7, 0.9];

/// Slope roughness α.
const ALPHAS: [f64; 5] = [0.1, 0.25, 0.5, 0.75, 1.0];

/// cosθ of the light.
const COSINES: [f64; 5] = [1.0, 0.75, 0.5, 0.25, 0.1];

/// What the facets are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// Mirrors.
    Conductor,
    /// Smooth interfaces of this index, inside over outside.
    Dielectric(f64),
    /// Lambertian.
    Diffuse,
}

/// A surface and where its light comes from.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// Its facets.
    pub kind: Kind,
    /// Its normals.
    pub ndf: Distribution,
    /// cosθ of the light; `None` for diffuse light.
    pub cos: Option<f64>,
    /// The first of its scramblings.
    seed: u32,
}

/// What becomes of the light, as shares of what came.
#[derive(Clone, Debug)]
pub struct Shares {
    /// The case.
    pub case: Case,
    /// Walks of each scrambled set.
    pub points: u32,
    /// Reflected and transmitted, all orders.
    pub sides: [Mean; 2],
    /// The same by order.
    pub orders: [[Mean; ORDERS]; 2],
    /// What comes back from facets of [`REFLECTANCES`].
    pub colored: [Mean; REFLECTANCES.len()],
}

/// All cases of the tables.
pub fn cases() -> Vec<Case> {
    let kinds = [
        Kind::Conductor,
        Kind::Dielectric(1.5),
        Kind::Dielectric(1.0 / 1.5),
        Kind::Diffuse,
    ];
    let mut all = Vec::new();
    for kind in kinds {
        for alpha in ALPHAS {
            for ndf in [
                Distribution::Ggx(Ggx::isotropic(alpha)),
                Distribution::Beckmann(Beckmann::isotropic(alpha)),
            ] {
                for cos in COSINES.map(Some).into_iter().chain([None]) {
                    let seed = REPLICATES * all.len() as u32;
                    all.push(Case {
                        kind,
                        ndf,
                        cos,
                        seed,
                    });
                }
            }
        }
    }
    all
}

/// Measures cases on all cores, until no standard error is above `error`.
pub fn measured(cases: &[Case], error: f64) -> Vec<Shares> {
    cases
        .par_iter()
        .map(|case| {
            let mut points = POINTS[0];
            loop {
                let found = case.shares(points);
                if found.worst() <= error || points == POINTS[1] {
                    return found;
                }
                points *= 2;
            }
        })
        .collect()
}

impl Case {
    /// By `points` walks of each scrambled set.
    pub fn shares(&self, points: u32) -> Shares {
        let white = Rgb::white();
        let fresnel = ConductorFresnel::Constant(white);
        match self.kind {
            Kind::Conductor => shares(*self, Conductor { fresnel }, points),
            Kind::Dielectric(eta) => shares(*self, Dielectric { eta, tint: white }, points),
            Kind::Diffuse => shares(*self, Diffuse { albedo: white }, points),
        }
    }
}

fn shares(case: Case, facets: impl Facets<Scalar = f64>, points: u32) -> Shares {
    const SIDE: usize = 1 + ORDERS;
    const QUANTITIES: usize = 2 * SIDE + REFLECTANCES.len();
    let divides = match case.kind {
        Kind::Dielectric(eta) => Some(eta),
        _ => None,
    };
    let found = replicated_many(0x7ab1e, case.seed, points, |rng: &mut Sobol| {
        let mut found = [0.0; QUANTITIES];
        let cos = case.cos.unwrap_or_else(|| {
            let u: f64 = rng.draw();
            (1.0 - u).sqrt()
        });
        walk(
            &case.ndf,
            (&facets, divides),
            cos,
            rng,
            |side, order, share| {
                let at = match side {
                    Side::Above => 0,
                    Side::Below => SIDE,
                };
                found[at] += share;
                found[at + (order as usize).min(ORDERS)] += share;
                if side == Side::Above {
                    for (sum, c) in found[2 * SIDE..].iter_mut().zip(REFLECTANCES) {
                        *sum += share * c.powi(order);
                    }
                }
            },
        );
        found
    });
    let orders = |side: usize| std::array::from_fn(|k| found[side + 1 + k]);
    Shares {
        case,
        points,
        sides: [found[0], found[SIDE]],
        orders: [orders(0), orders(SIDE)],
        colored: std::array::from_fn(|i| found[2 * SIDE + i]),
    }
}

/// Light that has less left is decided about by dice.
const LEAST: f64 = 0.01;

/// Light that has as much left goes both ways at a facet that divides it.
const MUCH: f64 = 0.1;

/// Light at a facet.
#[derive(Clone, Copy)]
struct Ray {
    side: Side,
    /// Where it comes from, in the frame of `side`.
    w: Vector3<f64>,
    depth: f64,
    weight: f64,
    order: i32,
}

/// The number that a facet decides by.
struct Decided(f64);

impl Draw<f64> for Decided {
    fn draw(&mut self) -> f64 {
        self.0
    }
}

/// Light from cosθ = `cos` among facets, those of an index if they divide it; `leaves`
/// is told the side, the order and the share of the light that leaves there.
fn walk(
    ndf: &Distribution,
    (facets, divides): (&impl Facets<Scalar = f64>, Option<f64>),
    cos: f64,
    rng: &mut Sobol,
    mut leaves: impl FnMut(Side, i32, f64),
) {
    let free_path = |u: f64| -(-u).ln_1p();
    let w = Vector3::spherical(cos, 0.0);
    let mut rays = vec![Ray {
        side: Side::Above,
        w,
        depth: free_path(rng.draw()) * cos / ndf.projected_area(w),
        weight: 1.0,
        order: 1,
    }];
    while let Some(ray) = rays.pop() {
        let Ray { side, w, .. } = ray;
        let m = ndf.sample_visible(w, [rng.draw(), rng.draw()]);
        let eta = divides.filter(|_| ray.weight > MUCH).map(|eta| match side {
            Side::Above => eta,
            Side::Below => 1.0 / eta,
        });
        let ways = match eta {
            None => [(facets.scatter(side, w, m, rng), 1.0)]
                .into_iter()
                .chain(None),
            Some(eta) => {
                let (reflected, _) = fresnel::dielectric(w.dot(m).clamp(0.0, 1.0), eta);
                let way = |u| facets.scatter(side, w, m, &mut Decided(u));
                let through = (reflected < 1.0).then(|| (way(1.0), 1.0 - reflected));
                [(way(0.0), reflected)].into_iter().chain(through)
            }
        };
        for (bounce, share) in ways {
            let mut next = Ray {
                weight: ray.weight * share,
                ..ray
            };
            let mut d = bounce.direction;
            if bounce.crosses {
                // The frame of the other side, in which heights are turned over.
                d = -d;
                next.side = side.other();
                next.depth = if ray.depth > LN_2 {
                    -(-(-ray.depth).exp()).ln_1p()
                } else {
                    -(-(-ray.depth.max(f64::MIN_POSITIVE)).exp_m1()).ln()
                };
            }
            next.w = -d;
            let rate = ndf.projected_area(next.w) / d.z.abs();
            let u: f64 = rng.draw();
            if d.z > 0.0 {
                let stays = -(-rate * next.depth).exp_m1();
                leaves(next.side, ray.order, next.weight * (1.0 - stays));
                next.weight *= stays;
                next.depth = (next.depth - free_path(u * stays) / rate).max(0.0);
            } else {
                next.depth += free_path(u) / rate;
            }
            if next.weight < LEAST {
                let dice: f64 = rng.draw();
                if dice * LEAST >= next.weight {
                    continue;
                }
                next.weight = LEAST;
            }
            next.order += 1;
            rays.push(next);
        }
    }
}

impl Case {
    /// Facets, η, distribution, α and cosθ as cells of a table.
    fn cells(&self) -> [String; 5] {
        let (facets, eta) = match self.kind {
            Kind::Conductor => ("conductor", String::new()),
            Kind::Dielectric(eta) => ("dielectric", format!("{eta:.10}")),
            Kind::Diffuse => ("diffuse", String::new()),
        };
        let eta = eta.trim_end_matches('0').to_owned();
        let normals = match self.ndf {
            Distribution::Ggx(_) => "ggx",
            _ => "beckmann",
        };
        let alpha = self.ndf.alpha().0.to_string();
        let cos = self.cos.map_or_else(String::new, |cos| cos.to_string());
        [facets.to_owned(), eta, normals.to_owned(), alpha, cos]
    }
}

/// A value and its standard error: of errors two digits, of values as many as go with it.
fn cell(mean: &Mean) -> String {
    let error = mean.error();
    if error < 1e-9 {
        return format!("{:.6},0", mean.mean);
    }
    format!("{:.6},{error:.1e}", mean.mean)
}

impl Shares {
    /// A line of `orders.csv`.
    pub fn line(&self) -> String {
        let mut line = self.case.cells().join(",");
        let sides = if matches!(self.case.kind, Kind::Dielectric(_)) {
            2
        } else {
            1
        };
        for orders in &self.orders[..sides] {
            for order in orders {
                line += ",";
                line += &cell(order);
            }
        }
        line + &",".repeat(2 * ORDERS * (2 - sides))
    }

    /// Lines of `albedo.csv`, in the columns of `smithwalk conform`.
    pub fn albedos(&self) -> Vec<String> {
        let [facets, eta, normals, alpha, cos] = self.case.cells();
        let quantity = if cos.is_empty() {
            "mean_albedo"
        } else {
            "albedo"
        };
        let line = |quantity: &str, color: &str, mean: &Mean| {
            let value = cell(mean);
            format!("{quantity},{facets},{eta},{color},{normals},{alpha},{cos},{value},31")
        };
        if !matches!(self.case.kind, Kind::Dielectric(_)) {
            let colored = self.colored.iter().zip(REFLECTANCES);
            return colored
                .map(|(mean, c)| line(quantity, &c.to_string(), mean))
                .collect();
        }
        let mut lines = vec![line(quantity, "1", &self.sides[0])];
        if !cos.is_empty() {
            lines.push(line("transmitted", "1", &self.sides[1]));
        }
        lines
    }

    /// The largest standard error of a value.
    pub fn worst(&self) -> f64 {
        let orders = self.orders.iter().flatten();
        let all = orders.chain(&self.sides).chain(&self.colored);
        all.map(Mean::error).fold(0.0, f64::max)
    }
}

/// The header of `orders.csv`: r for reflected, t for transmitted, and the order.
pub fn orders_header() -> String {
    let mut header = "facets,eta,distribution,alpha,cos".to_owned();
    for side in ["r", "t"] {
        for order in 1..=ORDERS {
            header += &format!(",{side}{order},{side}{order}_stderr");
        }
    }
    header
}

/// The header of `albedo.csv`.
pub const ALBEDO_HEADER: &str =
    "quantity,facets,eta,color,distribution,alpha,cos,value,stderr,freedom";
