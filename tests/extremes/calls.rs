//! Every entry point of the model over the whole domain, one call at a time.

use super::domain::{ALPHAS, COSINES, ETAS, Grazing, Metered, direction, largest, metals, stream};
use super::findings::{Findings, Kind};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use smithwalk_model::*;

/// From this order on, a walk may end by roulette alone and its weight exceed 1.
const LONG: u32 = 1 << 14;

/// A walk gets to order n > 16384 with a chance of (16384/n)² at most, and draws six
/// numbers a step; two walks a call. So 1000 times 16384 orders have a chance of 2e-6 per
/// call that gets past 16384, of which a grid has hundreds.
const MOST_DRAWS: usize = 6 * 1000 * LONG as usize;

/// On surfaces of α ≤ 1 a walk meets two facets or three on average, and its
/// order falls off exponentially: 100 orders of six draws, in two walks, are
/// four times what 10⁶ calls need. Glass that hardly refracts is another
/// matter: a level ray goes straight through one facet after the other, about
/// Λ of them.
const MOST_DRAWS_SMOOTH: usize = 2 * 6 * 100;

fn valid<F: Real>(value: Rgb<F>) -> bool {
    value.0.iter().all(|c| c.is_finite() && *c >= F::zero())
}

/// Pairs near grazing that a test asks, 660 calls each.
const PAIRS: usize = 3000;

/// What is asked of a surface.
pub struct Question<'a, F> {
    pub wi: Vector3<F>,
    pub wo: Vector3<F>,
    /// The first random numbers of every call.
    pub first: &'a [F],
    pub seed: u64,
    /// Stands between the generator and the surface.
    pub numbers: fn(F) -> F,
    /// Whether no α is above 1, so that walks are short.
    pub smooth: bool,
    /// Leaves out surfaces on which walks may be long.
    pub short: bool,
}

/// The numbers as a [`Question`] has them.
struct Numbers<'a, F> {
    meter: Metered<'a, F>,
    change: fn(F) -> F,
}

impl<F: Real> Draw<F> for Numbers<'_, F>
where
    Stream<Pcg64Mcg>: Draw<F>,
{
    fn draw(&mut self) -> F {
        (self.change)(self.meter.draw())
    }
}

impl<'a, F: Real> Question<'a, F>
where
    Stream<Pcg64Mcg>: Draw<F>,
{
    fn numbers(&self) -> Numbers<'a, F> {
        Numbers {
            meter: Metered::new(self.first, self.seed),
            change: self.numbers,
        }
    }

    fn context(&self, what: &str) -> String {
        format!(
            "{what}, {:?} → {:?}, first draws {:?}, seed {}",
            self.wi, self.wo, self.first, self.seed
        )
    }

    /// Counts a call that drew `drawn` numbers.
    fn drew(&self, drawn: usize, what: &str, found: &mut Findings) {
        found.calls += 1;
        found.most_draws[1] = drawn.max(found.most_draws[1]);
        let mut bound = MOST_DRAWS;
        if self.smooth {
            found.most_draws[0] = drawn.max(found.most_draws[0]);
            bound = MOST_DRAWS_SMOOTH;
        }
        found.expect(drawn <= bound, Kind::Steps, || {
            format!("{}: {drawn} draws", self.context(what))
        });
    }

    /// Asks one surface, through every entry point. `lossless` says that
    /// nothing is absorbed.
    pub fn ask<N: Ndf<Scalar = F>, I: Facets<Scalar = F>>(
        &self,
        what: &str,
        surface: &Microsurface<N, I>,
        lossless: bool,
        found: &mut Findings,
    ) {
        if self.short && !self.smooth {
            return;
        }
        let (wi, wo) = (self.wi, self.wo);
        let mut rng = self.numbers();
        let exit = surface.sample(wi, &mut rng);
        self.drew(rng.meter.drawn, what, found);
        let played = rng.meter.drawn > 3 * LONG as usize;
        self.judge_sample(what, surface, exit, lossless && !played, found);

        let mut rng = self.numbers();
        let single = surface.sample_single(wi, &mut rng);
        self.drew(rng.meter.drawn, what, found);
        if let Some(exit) = single {
            self.judge_exit(what, surface, exit, found);
        }
        found.calls += 1;
        let pdf = surface.pdf(wi, wo);
        found.expect(pdf.is_finite() && pdf >= F::zero(), Kind::Density, || {
            format!("{}: pdf {pdf:?}", self.context(what))
        });
        for estimator in [Estimator::Walk, Estimator::TwoWalk, Estimator::PositionFree] {
            let mut total = Total::default();
            let mut rng = self.numbers();
            surface.eval(estimator, wi, wo, &mut rng, &mut total);
            self.drew(rng.meter.drawn, what, found);
            found.expect(valid(total.0), Kind::Value, || {
                format!("{}: {estimator:?} gives {total:?}", self.context(what))
            });
            found.expect(
                pdf > F::zero() || total.0.max_channel() <= F::zero(),
                Kind::Density,
                || {
                    let context = self.context(what);
                    format!("{context}: {estimator:?} gives {total:?} at density 0")
                },
            );
        }
        let mut rng = self.numbers();
        let single = surface.eval_single(wi, wo, &mut rng);
        self.drew(rng.meter.drawn, what, found);
        found.expect(valid(single), Kind::Value, || {
            format!("{}: first order {single:?}", self.context(what))
        });
    }

    fn judge_sample<N: Ndf<Scalar = F>, I: Facets<Scalar = F>>(
        &self,
        what: &str,
        surface: &Microsurface<N, I>,
        exit: Option<Exit<F>>,
        lossless: bool,
        found: &mut Findings,
    ) {
        let Some(exit) = exit else {
            // Below 1e-30, nothing comes in.
            let enters = self.wi.z > F::of(1e-30);
            found.expect(!(lossless && enters), Kind::Energy, || {
                format!("{}: nothing leaves", self.context(what))
            });
            return;
        };
        self.judge_exit(what, surface, exit, found);
        if exit.order < LONG {
            let weight = exit.weight;
            let slack = F::epsilon() * F::of(f64::from(exit.order));
            let fine =
                weight.max_channel() <= F::one() + slack && (!lossless || weight == Rgb::white());
            found.expect(fine, Kind::Energy, || {
                format!("{}: {exit:?}", self.context(what))
            });
        }
    }

    fn judge_exit<N: Ndf<Scalar = F>, I: Facets<Scalar = F>>(
        &self,
        what: &str,
        surface: &Microsurface<N, I>,
        exit: Exit<F>,
        found: &mut Findings,
    ) {
        found.expect(valid(exit.weight), Kind::Value, || {
            format!("{}: {exit:?}", self.context(what))
        });
        let length = exit.direction.length().as_f64();
        found.expect(
            (length - 1.0).abs() < 1e-5 && exit.direction.z != F::zero() && exit.order >= 1,
            Kind::Direction,
            || format!("{}: {exit:?} of length {length}", self.context(what)),
        );
        found.calls += 2;
        let invisible = surface.facets.invisible().is_some();
        let pdf = surface.pdf(self.wi, exit.direction);
        found.expect(
            pdf.is_finite() && (pdf > F::zero() || invisible),
            Kind::Density,
            || format!("{}: {exit:?} has pdf {pdf:?}", self.context(what)),
        );
        let pdf = surface.pdf_single(self.wi, exit.direction);
        found.expect(pdf.is_finite() && pdf >= F::zero(), Kind::Density, || {
            format!("{}: {exit:?} has pdf_single {pdf:?}", self.context(what))
        });
    }

    /// Asks all facets on one distribution of normals.
    pub fn ask_all<N: Ndf<Scalar = F>>(&self, name: &str, ndf: N, found: &mut Findings) {
        let rgb = |v: [f64; 3]| Rgb(v.map(F::of));
        for fresnel in metals() {
            let surface = Microsurface {
                ndf,
                facets: Conductor { fresnel },
            };
            let lossless = fresnel == ConductorFresnel::Constant(Rgb::white());
            self.ask(&format!("{name} {fresnel:?}"), &surface, lossless, found);
        }
        for eta in ETAS {
            let facets = Dielectric {
                eta: F::of(eta),
                tint: Rgb::white(),
            };
            let surface = Microsurface { ndf, facets };
            let what = format!("{name} η {eta}");
            let smooth = self.smooth && (eta - 1.0).abs() > 0.1;
            for wo in [self.wo, -self.wo] {
                Self {
                    wo,
                    smooth,
                    ..*self
                }
                .ask(&what, &surface, true, found);
            }
        }
        for albedo in [[1.0; 3], [0.0; 3], [0.9, 0.0, 0.5]] {
            let facets = Diffuse {
                albedo: rgb(albedo),
            };
            let surface = Microsurface { ndf, facets };
            let what = format!("{name} diffuse {albedo:?}");
            self.ask(&what, &surface, albedo == [1.0; 3], found);
        }
    }
}

/// What the first numbers of a call are, at and next to 0 and 1.
pub fn starts<F: Real>() -> [Vec<F>; 5] {
    let (zero, half, top) = (F::zero(), F::of(0.5), largest());
    [
        vec![],
        vec![zero; 12],
        vec![top; 12],
        vec![half, zero, top, zero, top],
        vec![zero, top, half, top],
    ]
}

/// Half of all pairs of cosines, with the first numbers in turn.
pub fn grid_at<F: Real>(
    [smooth, short]: [bool; 2],
    seed: u64,
    numbers: fn(F) -> F,
    ask: impl Fn(&Question<F>, &mut Findings),
) -> Findings
where
    Stream<Pcg64Mcg>: Draw<F>,
{
    let mut found = Findings::default();
    let starts = starts();
    for (i, ci) in COSINES.into_iter().enumerate() {
        for (o, co) in COSINES.into_iter().enumerate() {
            // The other half with the next seed.
            if (i / 2 + o + seed as usize) % 2 == 1 {
                continue;
            }
            let phi = [0.3 + std::f64::consts::PI, 1.0][o / 2 % 2];
            let question = Question {
                wi: direction(ci, 0.3),
                wo: direction(co, phi),
                first: &starts[(i + o + seed as usize) % starts.len()],
                seed: seed * 1000 + (i * COSINES.len() + o) as u64,
                numbers,
                smooth,
                short,
            };
            ask(&question, &mut found);
        }
    }
    found
}

/// The whole domain in one precision, or the part with short walks alone.
pub fn grid<F: Real>(seed: u64, short: bool) -> Findings
where
    Stream<Pcg64Mcg>: Draw<F>,
{
    let at = |(ax, ay): (f64, f64)| {
        let (alpha_x, alpha_y) = (F::of(ax), F::of(ay));
        let kind = [ax <= 1.0 && ay <= 1.0, short];
        let ggx = Ggx { alpha_x, alpha_y };
        let beckmann = Beckmann { alpha_x, alpha_y };
        let [a, b] = ["GGX", "Beckmann"].map(|name| format!("{name} {ax} {ay}"));
        grid_at(
            kind,
            seed,
            |u| u,
            |question, found| {
                question.ask_all(&a, ggx, found);
                question.ask_all(&b, beckmann, found);
            },
        )
    };
    let quadratic = grid_at(
        [true, short],
        seed,
        |u| u,
        |question, found| {
            question.ask_all("Quadratic", Quadratic::new(), found);
        },
    );
    let all = ALPHAS.into_par_iter().map(at);
    all.reduce(Findings::default, Findings::merged)
        .merged(quadratic)
}

/// Pairs of directions near grazing and near mirror directions.
pub fn grazing<F: Real>(seed: u64, pairs: usize, short: bool) -> Findings
where
    Stream<Pcg64Mcg>: Draw<F>,
{
    let starts = starts::<F>();
    let at = |pair: usize| {
        let mut found = Findings::default();
        let seed = (seed << 32) + pair as u64;
        let Grazing {
            alpha: (ax, ay),
            ends: [wi, wo],
        } = Grazing::new(&mut stream(seed));
        let question = Question {
            wi: direction(wi.0, wi.1),
            wo: direction(wo.0, wo.1),
            // Mostly random ones: what happens there depends on several.
            first: &starts[(pair % 16).saturating_sub(11)],
            seed,
            numbers: |u| u,
            smooth: ax <= 1.0 && ay <= 1.0,
            short,
        };
        let (alpha_x, alpha_y) = (F::of(ax), F::of(ay));
        let name = format!("GGX {ax} {ay}");
        question.ask_all(&name, Ggx { alpha_x, alpha_y }, &mut found);
        let name = format!("Beckmann {ax} {ay}");
        question.ask_all(&name, Beckmann { alpha_x, alpha_y }, &mut found);
        found
    };
    let all = (0..pairs).into_par_iter().map(at);
    all.reduce(Findings::default, Findings::merged)
}

#[test]
fn grazing_pairs_hold_in_single_precision() {
    grazing::<f32>(0, PAIRS, true).assert_clean();
}

#[test]
fn grazing_pairs_hold_in_double_precision() {
    grazing::<f64>(1, PAIRS, true).assert_clean();
}

#[test]
fn the_grid_holds_in_single_precision() {
    grid::<f32>(0, false).assert_clean();
}

#[test]
fn the_grid_holds_in_double_precision() {
    grid::<f64>(1, false).assert_clean();
}

/// One seed in sixteen on all surfaces, the others where walks are short.
///
/// `cargo test --release --test suite extremes:: -- --ignored --nocapture`
#[test]
#[ignore = "1e8 calls take six minutes"]
fn the_grid_holds_for_a_hundred_million_calls() {
    let mut found = Findings::default();
    for seed in 2.. {
        let short = seed % 16 != 2;
        found = found
            .merged(grid::<f32>(seed, short))
            .merged(grid::<f64>(seed, short))
            .merged(grazing::<f32>(seed, PAIRS, short))
            .merged(grazing::<f64>(seed, PAIRS, short));
        if found.calls >= 100_000_000 {
            break;
        }
    }
    found.assert_clean();
}

/// Straight up from a facet no other is in the way: the light leaves, and no
/// later facet may turn an overflow into a value.
#[test]
fn a_walk_straight_up_leaves() {
    let mut found = Findings::default();
    Question {
        wi: direction::<f32>(0.001, 0.3),
        wo: Vector3::new(-0.0, -0.0, 1.0),
        first: &[0.0; 12],
        seed: 6060,
        numbers: |u| u,
        smooth: true,
        short: false,
    }
    .ask_all("GGX 1 1", Ggx::isotropic(1.0), &mut found);
    found.assert_clean();
}
