//! The validation finds faults: each test plants one into the model, and a
//! statement that must see it does not hold any more.

use smithwalk_model::{
    At, Bounce, Conductor, ConductorFresnel, Dielectric, Diffuse, Draw, Estimator, Exit, Facets,
    Microsurface, Ndf, Phase, Side, Tally, Vector3,
};
use smithwalk_validation::{Distribution, Effort, Model, Smithwalk, statement};

/// What is wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    None,
    /// Λ(ω) = −σ(−ω)/ω_z.
    LambdaSign,
    /// Λ = 0: nothing masks on the way out.
    NoMasking,
    /// The normals D(m) m_z instead of the visible ones.
    AllNormals,
    /// D is not normalised to the projected area.
    Unnormalised,
    /// The phase function of refraction without dω_m/dω_o.
    NoJacobian,
    /// n(below)/n(above) taken for its square, or for 1.
    WrongIndex,
    /// Upward rays that stay inside restart at the top, as in Cycles 3.
    TopHeight,
    /// Walks end after ten facets.
    Cap,
}

#[derive(Clone, Copy)]
struct FaultyNdf(Distribution, Fault);

impl Ndf for FaultyNdf {
    type Scalar = f64;

    fn density(&self, m: Vector3<f64>) -> f64 {
        let scale = if self.1 == Fault::Unnormalised {
            1.01
        } else {
            1.0
        };
        scale * self.0.density(m)
    }

    fn projected_area(&self, w: Vector3<f64>) -> f64 {
        self.0.projected_area(w)
    }

    fn lambda(&self, w: Vector3<f64>) -> f64 {
        match self.1 {
            Fault::LambdaSign => -self.0.lambda(w),
            Fault::NoMasking => 0.0,
            _ => self.0.lambda(w),
        }
    }

    fn sample_visible(&self, w: Vector3<f64>, u: [f64; 2]) -> Vector3<f64> {
        if self.1 != Fault::AllNormals {
            return self.0.sample_visible(w, u);
        }
        // Seen from above all normals are visible; those that face away from
        // w are turned round to it.
        let m = self.0.sample_visible(Vector3::new(0.0, 0.0, 1.0), u);
        if m.dot(w) > 0.0 {
            m
        } else {
            Vector3::new(-m.x, -m.y, m.z)
        }
    }
}

#[derive(Clone, Copy)]
struct FaultyGlass(Dielectric<f64>, Fault);

impl Facets for FaultyGlass {
    type Scalar = f64;

    const TRANSMITS: bool = true;
    const CLOSED_PHASE: bool = true;

    fn scatter(
        &self,
        side: Side,
        w: Vector3<f64>,
        m: Vector3<f64>,
        rng: &mut impl Draw<f64>,
    ) -> Bounce<f64> {
        self.0.scatter(side, w, m, rng)
    }

    fn phase<N: Ndf<Scalar = f64>>(
        &self,
        ndf: &N,
        at: At<f64>,
        o: Vector3<f64>,
        crosses: bool,
        m: Vector3<f64>,
    ) -> Phase<f64> {
        let mut phase = self.0.phase(ndf, at, o, crosses, m);
        if crosses && self.1 == Fault::NoJacobian {
            let eta = match at.side {
                Side::Above => self.0.eta,
                Side::Below => 1.0 / self.0.eta,
            };
            let h = at.w + o * eta;
            let length = h.length();
            let jacobian = eta * eta * h.dot(o).abs() / length.powi(3);
            phase.density /= jacobian.max(1e-12);
        }
        phase
    }

    fn inverted(&self) -> Self {
        Self(self.0.inverted(), self.1)
    }

    fn relative_index(&self) -> f64 {
        if self.1 == Fault::WrongIndex {
            1.0
        } else {
            self.0.relative_index()
        }
    }
}

/// The crate's model with a fault in it.
#[derive(Clone, Copy)]
struct Faulty(Fault);

impl Model for Faulty {
    type Ndf = FaultyNdf;
    type Conductor = Conductor<f64>;
    type Dielectric = FaultyGlass;
    type Diffuse = Diffuse<f64>;

    fn ndf(self, d: Distribution) -> FaultyNdf {
        FaultyNdf(d, self.0)
    }

    fn metal(self, fresnel: ConductorFresnel<f64>) -> Conductor<f64> {
        Conductor { fresnel }
    }

    fn dielectric(self, eta: f64) -> FaultyGlass {
        FaultyGlass(Smithwalk.dielectric(eta), self.0)
    }

    fn diffuse(self) -> Diffuse<f64> {
        Smithwalk.diffuse()
    }

    fn sample<I: Facets<Scalar = f64>>(
        self,
        surface: &Microsurface<FaultyNdf, I>,
        wi: Vector3<f64>,
        rng: &mut impl Draw<f64>,
    ) -> Option<Exit<f64>> {
        if self.0 == Fault::TopHeight && !I::TRANSMITS {
            return walk_from_the_top(surface, wi, rng);
        }
        let exit = surface.sample(wi, rng)?;
        (self.0 != Fault::Cap || exit.order <= 10).then_some(exit)
    }

    fn eval<I: Facets<Scalar = f64>>(
        self,
        surface: &Microsurface<FaultyNdf, I>,
        estimator: Estimator,
        wi: Vector3<f64>,
        wo: Vector3<f64>,
        rng: &mut impl Draw<f64>,
        tally: &mut impl Tally<f64>,
    ) {
        surface.eval(estimator, wi, wo, rng, tally);
    }
}

/// A walk that forgets its height, as that of Cycles up to 3.6: an upward ray
/// that does not escape goes on from C1 = 1, the top.
fn walk_from_the_top<I: Facets<Scalar = f64>>(
    surface: &Microsurface<FaultyNdf, I>,
    wi: Vector3<f64>,
    rng: &mut impl Draw<f64>,
) -> Option<Exit<f64>> {
    let ndf = surface.ndf;
    let (mut direction, mut depth, mut order) = (-wi, 0.0, 0);
    loop {
        let sigma = ndf.projected_area(-direction);
        let path = -(1.0 - rng.draw()).ln() * direction.z.abs() / sigma;
        if direction.z <= 0.0 {
            depth += path;
        } else if path >= depth {
            return Some(Exit {
                direction,
                weight: smithwalk_model::Rgb::white(),
                order,
            });
        } else {
            depth = 0.0;
        }
        let m = ndf.sample_visible(-direction, [rng.draw(), rng.draw()]);
        direction = surface
            .facets
            .scatter(Side::Above, -direction, m, rng)
            .direction;
        order += 1;
        if order > 1000 {
            return None;
        }
    }
}

fn holds(fault: Fault, number: u32) -> bool {
    let found = statement(Faulty(fault), Effort::Quick, number).expect("a statement");
    found.expect("figures").passed()
}

fn is_found(fault: Fault, by: u32) {
    assert!(!holds(fault, by), "statement {by} holds with {fault:?}");
}

#[test]
fn without_a_fault_the_wrapped_model_holds() {
    for number in [1, 2, 3, 4, 5, 6, 7, 9, 13] {
        assert!(holds(Fault::None, number), "statement {number}");
    }
}

#[test]
fn a_wrong_sign_of_lambda_is_found() {
    is_found(Fault::LambdaSign, 2);
}

#[test]
fn missing_masking_is_found() {
    is_found(Fault::NoMasking, 2);
    is_found(Fault::NoMasking, 3);
    is_found(Fault::NoMasking, 13);
}

#[test]
fn normals_that_are_not_the_visible_ones_are_found() {
    is_found(Fault::AllNormals, 4);
}

#[test]
fn a_density_off_by_one_percent_is_found() {
    is_found(Fault::Unnormalised, 1);
    is_found(Fault::Unnormalised, 9);
}

#[test]
fn a_missing_jacobian_is_found() {
    is_found(Fault::NoJacobian, 5);
    is_found(Fault::NoJacobian, 4);
}

#[test]
fn a_wrong_factor_of_n_squared_is_found() {
    is_found(Fault::WrongIndex, 7);
}

#[test]
fn heights_that_restart_at_the_top_are_found() {
    is_found(Fault::TopHeight, 6);
}

#[test]
fn a_cap_on_the_order_is_found() {
    is_found(Fault::Cap, 6);
}
