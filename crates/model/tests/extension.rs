//! The traits, implemented from outside of the crate.

use rand_pcg::Pcg32;
use smithwalk_model::rand::SeedableRng;
use smithwalk_model::wide::f32x8;
use smithwalk_model::*;

/// Another distribution, its tangent turned by 90°.
#[derive(Clone, Copy)]
struct Turned<N>(N);

fn turned<F: Real>(v: Vector3<F>) -> Vector3<F> {
    Vector3::new(v.y, -v.x, v.z)
}

fn turned_back<F: Real>(v: Vector3<F>) -> Vector3<F> {
    Vector3::new(-v.y, v.x, v.z)
}

impl<N: Ndf> Ndf for Turned<N> {
    type Scalar = N::Scalar;

    fn density(&self, m: Vector3<N::Scalar>) -> N::Scalar {
        self.0.density(turned(m))
    }

    fn projected_area(&self, w: Vector3<N::Scalar>) -> N::Scalar {
        self.0.projected_area(turned(w))
    }

    fn sample_visible(&self, w: Vector3<N::Scalar>, u: [N::Scalar; 2]) -> Vector3<N::Scalar> {
        turned_back(self.0.sample_visible(turned(w), u))
    }
}

/// The same in lanes.
impl<N: NdfInLanes> NdfInLanes for Turned<N> {
    type Lanes = Turned<N::Lanes>;

    fn in_lanes(&self) -> Self::Lanes {
        Turned(self.0.in_lanes())
    }
}

fn lanes_turned(v: Directions) -> Directions {
    let Directions { x, y, z } = v;
    Directions { x: y, y: -x, z }
}

impl<L: NdfLanes> NdfLanes for Turned<L> {
    fn density(&self, h: Directions) -> f32x8 {
        self.0.density(lanes_turned(h))
    }

    fn projected_areas(&self, w: Directions) -> [f32x8; 2] {
        self.0.projected_areas(lanes_turned(w))
    }

    fn sample_visible(&self, w: Directions, u: [f32x8; 2]) -> Directions {
        let Directions { x, y, z } = self.0.sample_visible(lanes_turned(w), u);
        Directions { x: -y, y: x, z }
    }
}

/// Mirrors that absorb nothing.
#[derive(Clone, Copy)]
struct Silver;

impl Facets for Silver {
    type Scalar = f64;
    const TRANSMITS: bool = false;
    const CLOSED_PHASE: bool = true;

    fn scatter(
        &self,
        _: Side,
        w: Vector3<f64>,
        m: Vector3<f64>,
        _: &mut impl Draw<f64>,
    ) -> Bounce<f64> {
        Bounce {
            direction: (m * (2.0 * w.dot(m)) - w).normalized(),
            crosses: false,
            weight: Rgb::white(),
        }
    }

    fn phase<N: Ndf<Scalar = f64>>(
        &self,
        ndf: &N,
        at: At<f64>,
        o: Vector3<f64>,
        crosses: bool,
        _: Vector3<f64>,
    ) -> Phase<f64> {
        let h = (at.w + o).normalized();
        let density = if crosses {
            0.0
        } else {
            ndf.density(h) / (4.0 * at.sigma)
        };
        Phase {
            density,
            weight: Rgb::white(),
        }
    }

    fn inverted(&self) -> Self {
        *self
    }
}

/// The largest order that was given something.
#[derive(Default)]
struct Deepest(u32);

impl Tally<f64> for Deepest {
    fn add(&mut self, order: u32, _: Rgb<f64>) {
        self.0 = self.0.max(order);
    }
}

/// Numbers for lanes.
struct Lanes(Stream<Pcg32>);

impl Draw<f32x8> for Lanes {
    fn draw(&mut self) -> f32x8 {
        std::array::from_fn::<f32, LANES, _>(|_| self.0.draw()).into()
    }
}

#[test]
fn facets_and_distributions_come_from_outside() {
    let ndf = Turned(Ggx {
        alpha_x: 0.8,
        alpha_y: 0.3,
    });
    let known = Microsurface {
        ndf: Ggx {
            alpha_x: 0.3,
            alpha_y: 0.8,
        },
        facets: Conductor {
            fresnel: ConductorFresnel::Constant(Rgb::white()),
        },
    };
    let ours = Microsurface {
        ndf,
        facets: Silver,
    };
    let (wi, wo) = (Vector3::spherical(0.6, 0.4), Vector3::spherical(0.3, 2.0));
    let mut rng = Stream(Pcg32::seed_from_u64(1));
    let found = ours.eval_single(wi, wo, &mut rng).0[0];
    let expected = known.eval_single(wi, wo, &mut rng).0[0];
    assert!((found / expected - 1.0).abs() < 1e-12, "{found} {expected}");
    let mut deepest = Deepest::default();
    for _ in 0..100 {
        ours.eval(Estimator::TwoWalk, wi, wo, &mut rng, &mut deepest);
    }
    assert!(deepest.0 > 1);
    assert!(ours.sample(wi, &mut rng).is_some());
}

#[test]
fn lanes_take_a_distribution_from_outside() {
    let facets = Conductor {
        fresnel: ConductorFresnel::Constant(Rgb::white()),
    };
    let ours = Microsurface {
        ndf: Turned(Beckmann {
            alpha_x: 0.8,
            alpha_y: 0.3,
        }),
        facets,
    };
    let known = Microsurface {
        ndf: Beckmann {
            alpha_x: 0.3,
            alpha_y: 0.8,
        },
        facets,
    };
    let wi = Vector3::spherical(0.6, 0.4);
    let wo = std::array::from_fn(|lane| Vector3::spherical(0.3, lane as f32));
    let mut rng = Lanes(Stream(Pcg32::seed_from_u64(1)));
    let found = ours.eval_lanes(wi, &wo, [1.0; LANES], &mut rng);
    let expected = known.eval_lanes(wi, &wo, [1.0; LANES], &mut rng);
    for (found, expected) in found.iter().zip(&expected) {
        let (found, expected) = (found.single.0[0], expected.single.0[0]);
        assert!((found / expected - 1.0).abs() < 1e-5, "{found} {expected}");
    }
}
