//! Rays over a periodic patch.

use glam::{DVec2, DVec3};

use super::field::{Patch, Random};
use crate::embree::Ray;
use smithwalk_model::{Exit, Facets, Rgb, Side, Vector3};

/// How far a ray is followed past the border of the patch, as a share of its
/// way there: far more than f32 rounds off, far less than the spare cell.
const SEAM: f64 = 1e-5;

/// Borders a ray may cross before it counts as lost. One at cosθ = 0.01
/// crosses a patch of 16 correlation lengths with α = 2 about 60 times.
const MAX_PATCHES: u32 = 100_000;

/// Facets met from behind that a ray passes before it counts as lost.
const MAX_PASSED: u32 = 64;

/// Facets met before light counts as lost: lossless walks of this length are
/// caught by rounding in a crease.
const MAX_ORDER: u32 = 10_000;

/// Light on its way over the patch.
#[derive(Clone, Copy, Debug)]
pub(super) struct Flight {
    /// In RMS heights.
    pub position: DVec3,
    /// Unit direction of travel.
    pub direction: DVec3,
    /// The side of the surface it is on.
    pub side: Side,
}

/// What becomes of light on its straight way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Meeting {
    /// It met a facet with this upper unit normal; the flight has moved there.
    Facet(DVec3),
    /// It left the surface, on the side it was on.
    Out,
    /// It left on the wrong side, or never: rounding. Callers count these.
    Lost,
}

impl Patch {
    /// A place at the level of the highest point, uniform over the patch.
    pub fn on_top(&self, u: [f64; 2]) -> DVec3 {
        let across = (2.0 * DVec2::from(u) - 1.0) * self.half;
        across.extend(self.high)
    }

    /// Takes `flight` to the next facet.
    pub fn meet(&self, flight: &mut Flight) -> Meeting {
        let d = flight.direction;
        for _ in 0..MAX_PATCHES {
            let p = flight.position;
            let vertical = time_to(p.z, d.z, self.low, self.high);
            let border = time_to(p.x, d.x, -self.half.x, self.half.x).min(time_to(
                p.y,
                d.y,
                -self.half.y,
                self.half.y,
            ));
            let way = vertical.min(border);
            if let Some((place, normal)) = self.first_facing(flight, way * (1.0 + SEAM)) {
                flight.position = self.wrapped(place);
                return Meeting::Facet(normal);
            }
            if vertical <= border {
                return if (d.z > 0.0) == (flight.side == Side::Above) {
                    Meeting::Out
                } else {
                    Meeting::Lost
                };
            }
            flight.position = self.across_border(p + d * border, d);
        }
        Meeting::Lost
    }

    /// The first facet within `way` that turns towards the flight's side.
    ///
    /// A facet seen from behind says that rounding put the flight's origin
    /// behind the facet it comes from: no other light sees one. It is passed,
    /// so no offset and no smallest distance is needed to leave a facet.
    fn first_facing(&self, flight: &Flight, way: f64) -> Option<(DVec3, DVec3)> {
        let mut ray = Ray {
            origin: flight.position.as_vec3(),
            direction: flight.direction.as_vec3(),
            t_near: 0.0,
            t_far: way as f32,
        };
        for _ in 0..MAX_PASSED {
            let hit = self.accelerator().intersect(ray)?;
            let (place, normal) = self.facet(&hit);
            if (flight.direction.dot(normal) < 0.0) == (flight.side == Side::Above) {
                return Some((place, normal));
            }
            ray.t_near = hit.t.max(ray.t_near) * (1.0 + 2.0 * f32::EPSILON) + f32::EPSILON;
        }
        None
    }

    /// `p`, a period further on each axis along which `d` has reached the border.
    fn across_border(&self, p: DVec3, d: DVec3) -> DVec3 {
        let step = |p: f64, d: f64, half: f64| {
            // The border is reached up to rounding, and the others are not.
            if p.abs() >= half * (1.0 - 1e-12) && p * d > 0.0 {
                -half.copysign(p)
            } else {
                p
            }
        };
        DVec3::new(
            step(p.x, d.x, self.half.x),
            step(p.y, d.y, self.half.y),
            p.z,
        )
    }

    /// `p` taken into the period.
    fn wrapped(&self, p: DVec3) -> DVec3 {
        let wrap = |x: f64, half: f64| {
            if x.abs() > half {
                x - (2.0 * half).copysign(x)
            } else {
                x
            }
        };
        DVec3::new(wrap(p.x, self.half.x), wrap(p.y, self.half.y), p.z)
    }

    /// The whole walk of light that comes from `wi` (unit, z > 0) and falls on
    /// the top at `u`; `None` if it got lost to rounding. The facets are those
    /// of the model, the normals those of the mesh.
    pub fn walk<I: Facets<Scalar = f64>>(
        &self,
        facets: &I,
        wi: Vector3<f64>,
        u: [f64; 2],
        rng: &mut Random,
    ) -> Option<Exit<f64>> {
        let mut flight = Flight {
            position: self.on_top(u),
            direction: -DVec3::new(wi.x, wi.y, wi.z),
            side: Side::Above,
        };
        let mut weight = Rgb::white();
        for order in 0..MAX_ORDER {
            match self.meet(&mut flight) {
                Meeting::Lost => return None,
                Meeting::Out => {
                    return Some(Exit {
                        direction: local(flight.direction, Side::Above),
                        weight,
                        order,
                    });
                }
                Meeting::Facet(normal) => {
                    let side = flight.side;
                    // The lower side's frame is the world's, reflected at the
                    // origin, and so is the normal that its light sees: the
                    // coordinates of the upper normal serve both.
                    let m = local(normal, Side::Above);
                    let bounce = facets.scatter(side, local(-flight.direction, side), m, rng);
                    let o = local_to_world(bounce.direction, side);
                    flight.direction = o.normalize();
                    weight *= bounce.weight;
                    if bounce.crosses {
                        flight.side = side.other();
                    }
                }
            }
        }
        None
    }
}

/// The time from `x` at speed `d` to the end of [low, high] that it goes to.
fn time_to(x: f64, d: f64, low: f64, high: f64) -> f64 {
    let end = if d > 0.0 { high } else { low };
    if d == 0.0 {
        f64::INFINITY
    } else {
        ((end - x) / d).max(0.0)
    }
}

/// A world direction in the model's frame of `side`.
fn local(d: DVec3, side: Side) -> Vector3<f64> {
    let v = Vector3::new(d.x, d.y, d.z);
    match side {
        Side::Above => v,
        Side::Below => -v,
    }
}

fn local_to_world(v: Vector3<f64>, side: Side) -> DVec3 {
    let d = DVec3::new(v.x, v.y, v.z);
    match side {
        Side::Above => d,
        Side::Below => -d,
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::super::departure::Estimate;
    use super::super::field::{Grid, stream, synthesize};
    use super::*;
    use crate::embree::Device;
    use smithwalk_model::{Conductor, ConductorFresnel, Dielectric, Draw};

    const GRID: Grid = Grid {
        side: 12.0,
        cells: 96,
    };

    fn patch(device: &Arc<Device>, alpha: [f64; 2], rng: &mut Random) -> Patch {
        Patch::new(device, GRID, &synthesize(GRID, rng), alpha).expect("a surface")
    }

    fn device() -> Arc<Device> {
        Arc::new(Device::new(1).expect("Embree is installed"))
    }

    /// From straight above, the slopes of the facets that are hit have the
    /// variance α²/2 along each axis.
    #[test]
    fn facets_have_the_slopes_of_beckmann() {
        let (device, alpha) = (device(), [1.0, 0.25]);
        let variances: Vec<[f64; 2]> = (0..24)
            .map(|seed| {
                let mut rng = stream(seed, 1);
                let patch = patch(&device, alpha, &mut rng);
                let mut sums = [0.0; 2];
                for _ in 0..2000 {
                    let mut flight = Flight {
                        position: patch.on_top([rng.draw(), rng.draw()]),
                        direction: DVec3::NEG_Z,
                        side: Side::Above,
                    };
                    let Meeting::Facet(n) = patch.meet(&mut flight) else {
                        panic!("{flight:?} met nothing");
                    };
                    sums[0] += (n.x / n.z).powi(2) / 2000.0;
                    sums[1] += (n.y / n.z).powi(2) / 2000.0;
                }
                sums
            })
            .collect();
        // The mesh's slopes are difference quotients over a cell.
        let cell = GRID.side / GRID.cells as f64;
        let flattening = -(-cell * cell).exp_m1() / (cell * cell);
        for axis in 0..2 {
            let seen = Estimate::of(variances.iter().map(|v| v[axis]));
            let expected = 0.5 * alpha[axis].powi(2) * flattening;
            // Student's t with 23 degrees of freedom passes 5 once in 2e4.
            let score = (seen.value - expected) / seen.error;
            assert!(score.abs() < 5.0, "axis {axis}: {seen:?} for {expected}");
        }
    }

    /// A ray hits the same facet however many borders lie before it.
    #[test]
    fn rays_go_on_across_the_border() {
        let mut rng = stream(3, 3);
        let patch = patch(&device(), [1.0; 2], &mut rng);
        let mut strays = 0;
        for _ in 0..2000 {
            let [u, v]: [f64; 2] = [rng.draw(), rng.draw()];
            let near = Flight {
                position: patch.on_top([rng.draw(), rng.draw()]),
                direction: DVec3::new(u - 0.5, v - 0.5, -0.1).normalize(),
                side: Side::Above,
            };
            let mut far = near;
            let back = near.position - near.direction * (7.3 * patch.half.x);
            far.position = DVec3::new(
                back.x - 2.0 * patch.half.x * (back.x / (2.0 * patch.half.x)).round(),
                back.y - 2.0 * patch.half.y * (back.y / (2.0 * patch.half.y)).round(),
                back.z,
            );
            let mut near = near;
            assert!(matches!(patch.meet(&mut near), Meeting::Facet(_)));
            assert!(matches!(patch.meet(&mut far), Meeting::Facet(_)));
            strays += u32::from(near.position.distance(far.position) > 1e-3);
        }
        // Those that graze a crest, or land on the border itself.
        assert!(strays <= 10, "{strays} of 2000 went elsewhere");
    }

    /// Facets without loss lose nothing, and light stays on its side.
    #[test]
    fn lossless_walks_all_come_out() {
        let mut rng = stream(4, 4);
        let patch = patch(&device(), [2.0; 2], &mut rng);
        let mirror = Conductor {
            fresnel: ConductorFresnel::Constant(Rgb::white()),
        };
        let glass = Dielectric {
            eta: 1.5,
            tint: Rgb::white(),
        };
        let wi = Vector3::spherical(0.3, 0.0);
        let mut below = 0;
        for _ in 0..5000 {
            let u = [rng.draw(), rng.draw()];
            let exit = patch.walk(&mirror, wi, u, &mut rng).expect("not lost");
            assert!(exit.direction.z > 0.0 && exit.order > 0);
            let exit = patch.walk(&glass, wi, u, &mut rng).expect("not lost");
            assert_eq!(exit.weight, Rgb::white());
            below += u32::from(exit.direction.z < 0.0);
        }
        assert!(
            (2500..5000).contains(&below),
            "{below} of 5000 went through"
        );
    }
}
