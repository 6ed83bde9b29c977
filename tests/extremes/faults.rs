//! The suite finds faults: each test plants one into the model, by wrapping its
//! normals, its facets or its random numbers.

use super::calls::{Question, grid_at};
use super::continuity::follow_normals;
use super::domain::largest;
use super::findings::{Findings, Kind};
use smithwalk_model::*;

/// GGX whose directions with |z| > 0.9999 have the σ, Λ and normals of the
/// pole.
#[derive(Clone, Copy)]
struct NormalIncidence<F>(Ggx<F>);

/// The pole that `w` is taken for.
fn pole<F: Real>(w: Vector3<F>) -> Vector3<F> {
    if w.z.abs() > F::of(0.9999) {
        Vector3::new(F::zero(), F::zero(), w.z.signum())
    } else {
        w
    }
}

impl<F: Real> Ndf for NormalIncidence<F> {
    type Scalar = F;

    fn density(&self, m: Vector3<F>) -> F {
        self.0.density(m)
    }

    fn projected_area(&self, w: Vector3<F>) -> F {
        self.0.projected_area(pole(w))
    }

    fn sample_visible(&self, w: Vector3<F>, u: [F; 2]) -> Vector3<F> {
        self.0.sample_visible(pole(w), u)
    }
}

/// Glass that refracts by the textbook: the cosine of the refracted ray is the
/// root of 1 − sin²θ/η², clamped to positive numbers or not.
#[derive(Clone, Copy)]
struct Textbook<F> {
    glass: Dielectric<F>,
    clamped: bool,
}

impl<F: Real> Facets for Textbook<F> {
    type Scalar = F;

    const TRANSMITS: bool = true;
    const CLOSED_PHASE: bool = true;

    fn scatter(
        &self,
        side: Side,
        w: Vector3<F>,
        m: Vector3<F>,
        rng: &mut impl Draw<F>,
    ) -> Bounce<F> {
        let (one, zero) = (F::one(), F::zero());
        let eta = match side {
            Side::Above => self.glass.eta,
            Side::Below => self.glass.eta.recip(),
        };
        let cos = w.dot(m).max(zero).min(one);
        let mut square = one - (one - cos * cos) / (eta * eta);
        if self.clamped {
            square = square.max(zero);
        }
        let cos_t = square.sqrt();
        let s = (cos - eta * cos_t) / (cos + eta * cos_t);
        let p = (eta * cos - cos_t) / (eta * cos + cos_t);
        let reflected = rng.draw() < F::of(0.5) * (s * s + p * p);
        let direction = if reflected {
            m * (cos + cos) - w
        } else {
            m * (cos / eta - cos_t) - w * eta.recip()
        };
        Bounce {
            direction: direction.normalized(),
            crosses: !reflected,
            weight: self.glass.tint,
        }
    }

    fn phase<N: Ndf<Scalar = F>>(
        &self,
        ndf: &N,
        at: At<F>,
        o: Vector3<F>,
        crosses: bool,
        m: Vector3<F>,
    ) -> Phase<F> {
        self.glass.phase(ndf, at, o, crosses, m)
    }

    fn inverted(&self) -> Self {
        Self {
            glass: self.glass.inverted(),
            ..*self
        }
    }

    fn relative_index(&self) -> F {
        self.glass.relative_index()
    }
}

/// Roughness at which walks are short, and one beyond.
const ALPHAS: [f64; 4] = [0.03, 0.3, 1.0, 8.0];

/// The suite in single precision, over a distribution made from α.
fn found<N: Ndf<Scalar = f32>>(ndf: fn(Ggx<f32>) -> N, numbers: fn(f32) -> f32) -> Findings {
    let mut all = Findings::default();
    for (seed, alpha) in ALPHAS.into_iter().enumerate() {
        let ndf = ndf(Ggx::isotropic(alpha as f32));
        let name = format!("α {alpha}");
        let kind = [alpha <= 1.0, false];
        let ask = |question: &Question<f32>, found: &mut Findings| {
            question.ask_all(&name, ndf, found);
        };
        all = all.merged(grid_at(kind, seed as u64, numbers, ask));
        follow_normals::<f32, _>(&name, ndf, alpha, &mut all);
    }
    println!("{all}");
    all
}

/// The suite on textbook glass.
fn found_in_glass(clamped: bool) -> Findings {
    let mut all = Findings::default();
    for (seed, alpha) in ALPHAS.into_iter().enumerate() {
        let ndf = Ggx::isotropic(alpha as f32);
        let kind = [alpha <= 1.0, false];
        let ask = |question: &Question<f32>, found: &mut Findings| {
            for eta in [0.5, 1.5, 10.0] {
                let tint = Rgb::white();
                let glass = Dielectric { eta, tint };
                let facets = Textbook { glass, clamped };
                let surface = Microsurface { ndf, facets };
                question.ask(&format!("α {alpha}, η {eta}"), &surface, true, found);
            }
        };
        all = all.merged(grid_at(kind, seed as u64, |u| u, ask));
    }
    println!("clamped {clamped}: {all}");
    all
}

#[test]
fn without_a_fault_nothing_is_found() {
    found(|ggx| ggx, |u| u).assert_clean();
    found_in_glass(true).assert_clean();
}

/// Past the critical angle the root of a negative number goes into the walk,
/// which no comparison ends any more.
#[test]
fn a_removed_clamp_is_found() {
    let found = found_in_glass(false);
    assert!(found.count(Kind::Steps) > 0);
}

/// As of 32 random bits that are rounded to `f32`: the largest become 1. A free
/// path is then infinite, and its light never comes back.
#[test]
fn a_random_number_of_one_is_found() {
    let one = |u| if u >= largest() { 1.0 } else { u };
    let found = found(|ggx| ggx, one);
    assert!(found.count(Kind::Steps) > 0 && found.count(Kind::Value) > 0);
}

#[test]
fn taking_steep_light_for_normal_incidence_is_found() {
    let found = found(NormalIncidence, |u| u);
    assert!(found.count(Kind::Jump) > 0);
}

/// The numbers of the suite reach both ends, or U = 1 could not be found.
#[test]
fn the_largest_number_is_asked_for() {
    let starts = super::calls::starts::<f32>();
    assert!(starts.iter().any(|s| s.contains(&largest())));
    assert!(starts.iter().any(|s| s.contains(&0.0)));
    let mut rng = super::domain::Metered::new(&starts[2], 0);
    let first: f32 = Draw::<f32>::draw(&mut rng);
    assert!(first < 1.0 && first + f32::EPSILON / 2.0 == 1.0);
}
