//! Tables of normals. False alarms: fixed seeds; a bound of 5 standard errors over the
//! some 100 comparisons of a test would fail about once in 17 000 runs of fresh ones.

use super::*;
use std::f64::consts::{FRAC_PI_2, PI};

/// The bound of standard scores.
const BOUND: f64 = 5.0;

/// The mean of D over `rings` rings, of the distribution that has D in proportion to
/// `density`(cosθ). Edges crowd at the normal.
fn table(rings: usize, density: impl Fn(f64) -> f64) -> NormalTable {
    let edge = |i: usize| FRAC_PI_2 * (i as f64 / rings as f64).powf(1.5);
    let edges: Vec<f64> = (0..=rings).map(edge).collect();
    let points = gauss(8);
    let means = edges.windows(2).map(|pair| {
        let z = [pair[0], pair[1]].map(f64::cos);
        let mean = |(x, weight): &(f64, f64)| {
            let at = z[1] + (z[0] - z[1]) * x;
            // By area seen from above, which the table is normalised by.
            (weight * density(at) * at, weight * at)
        };
        let [mut sum, mut area] = [0.0; 2];
        for (d, a) in points.iter().map(mean) {
            sum += d;
            area += a;
        }
        sum / area
    });
    NormalTable::new(&edges, &means.collect::<Vec<_>>()).expect("a table")
}

fn ggx(alpha: f64, rings: usize) -> NormalTable {
    let ggx = Ggx::isotropic(alpha);
    table(rings, |z| ggx.density(Vector3::spherical(z, 0.0)))
}

/// Three rings, one of them empty, and no normals at the horizon.
fn rings() -> NormalTable {
    NormalTable::new(&[0.0, 0.3, 0.7, 1.2], &[2.0, 0.0, 0.5]).expect("a table")
}

fn views() -> impl Iterator<Item = Vector3<f64>> {
    let cosines = [1.0, 0.95, 0.6, 0.2, 0.01, -0.01, -0.3, -0.7];
    cosines
        .into_iter()
        .enumerate()
        .map(|(i, cos)| Vector3::spherical(cos, 0.3 + i as f64))
}

#[test]
fn areas_are_integrals_over_the_normals() {
    for table in [rings(), ggx(0.5, 24)] {
        let d = table.normals::<f64>();
        // By plain points: rings are steps, which no rule of high order likes.
        let n = 1500;
        for w in views() {
            let mut sum = 0.0;
            for i in 0..n {
                let z = (i as f64 + 0.5) / n as f64;
                let density = d.density(Vector3::spherical(z, 0.0));
                for j in 0..256 {
                    let phi = PI * (j as f64 + 0.5) / 128.0;
                    sum += density * w.dot(Vector3::spherical(z, phi)).max(0.0);
                }
            }
            sum *= 2.0 * PI / (256.0 * n as f64);
            let area = d.projected_area(w);
            assert!((area - sum).abs() < 2e-3, "{w:?}: {area} against {sum}");
            assert!((area - d.projected_area(-w) - w.z).abs() < 1e-14, "{w:?}");
        }
    }
}

/// The density of normals seen from anywhere, by the means of three functions.
#[test]
fn visible_normals_have_their_density() {
    let moments = |m: Vector3<f64>| [m.z, m.x * m.y + m.y, m.x * m.x];
    for (case, table) in [rings(), ggx(0.5, 24)].iter().enumerate() {
        let d = table.normals::<f64>();
        for (view, w) in views().enumerate() {
            if d.projected_area(w) < 1e-3 {
                continue;
            }
            let mut rng = stream((20 * case + view) as u64);
            let mut seen = [Mean::default(); 3];
            let mut exact = [Mean::default(); 4];
            for _ in 0..40_000 {
                let m = d.sample_visible(w, [rng.draw(), rng.draw()]);
                assert!((m.length() - 1.0).abs() < 1e-12 && m.dot(w) > -1e-9);
                assert!(d.density(m) > 0.0);
                for (mean, x) in seen.iter_mut().zip(moments(m)) {
                    mean.add(x);
                }
                // Uniform on the hemisphere, by weight.
                let m = Vector3::spherical(rng.draw(), 2.0 * PI * Draw::<f64>::draw(&mut rng));
                let weight = 2.0 * PI * d.visible_density(w, m);
                exact[3].add(weight);
                for (mean, x) in exact.iter_mut().zip(moments(m)) {
                    mean.add(weight * x);
                }
            }
            assert!(exact[3].score(1.0).abs() < BOUND, "{w:?}: not normalised");
            for k in 0..3 {
                let score = seen[k].score_against(&exact[k]);
                assert!(score.abs() < BOUND, "{w:?}, moment {k}: {score}");
            }
        }
    }
}

/// All orders of a table, both ways and through glass.
#[test]
fn light_goes_both_ways_and_none_is_lost() {
    let table = rings();
    let ndf = table.normals::<f64>();
    let fresnel = ConductorFresnel::Constant(Rgb::white());
    let mirrors = Microsurface {
        ndf,
        facets: Conductor { fresnel },
    };
    let glass = |eta| Microsurface {
        ndf,
        facets: Dielectric {
            eta,
            tint: Rgb::white(),
        },
    };
    let (a, b) = (Vector3::spherical(0.8, 0.2), Vector3::spherical(0.4, 2.5));
    let mean = |seed, estimate: &dyn Fn(&mut Stream<Pcg64Mcg>) -> f64| {
        let mut rng = stream(seed);
        let mut mean = Mean::default();
        (0..40_000).for_each(|_| mean.add(estimate(&mut rng)));
        mean
    };
    for (seed, estimator) in [Estimator::TwoWalk, Estimator::PositionFree]
        .into_iter()
        .enumerate()
    {
        let value = |wi, wo: Vector3<f64>| {
            mean(seed as u64, &move |rng| {
                let mut total = Total::default();
                mirrors.eval(estimator, wi, wo, rng, &mut total);
                total.0.0[0] / wo.z
            })
        };
        let score = value(a, b).score_against(&value(b, a));
        assert!(score.abs() < BOUND, "{estimator:?}: {score}");
    }
    // f(ω_i, ω_o) n_i² = f(ω_o, ω_i) n_o².
    let below = -b;
    let through = |eta, wi, wo: Vector3<f64>| {
        mean(7, &move |rng| {
            let mut total = Total::default();
            glass(eta).eval(Estimator::TwoWalk, wi, wo, rng, &mut total);
            total.0.0[0] / wo.z.abs()
        })
    };
    let down = through(1.5, a, below);
    let up = through(1.0 / 1.5, b, -a).scaled(2.25);
    let score = down.score_against(&up);
    assert!(score.abs() < BOUND, "through glass: {score}");
    // The values, over both hemispheres, are all of the light.
    let all = mean(8, &|rng: &mut Stream<Pcg64Mcg>| {
        let cos = 2.0 * Draw::<f64>::draw(rng) - 1.0;
        let wo = Vector3::spherical(cos, 2.0 * PI * Draw::<f64>::draw(rng));
        let mut total = Total::default();
        glass(1.5).eval(Estimator::TwoWalk, a, wo, rng, &mut total);
        4.0 * PI * total.0.0[0]
    });
    assert!(all.score(1.0).abs() < BOUND, "{all:?}");
}

/// A table of GGX goes to GGX as rings become many: σ by the square of their width.
#[test]
fn a_table_of_ggx_is_ggx() {
    let exact = Ggx::isotropic(0.5);
    let worst = |rings| {
        let table = ggx(0.5, rings);
        let area = |w| (table.normals::<f64>().projected_area(w) - exact.projected_area(w)).abs();
        views().map(area).fold(0.0, f64::max)
    };
    let (coarse, fine) = (worst(32), worst(128));
    assert!(fine < 1e-4, "{fine}");
    assert!(fine < 0.1 * coarse, "{fine} {coarse}");

    let table = ggx(0.5, 128);
    let fresnel = ConductorFresnel::Constant(Rgb([1.0, 0.7, 0.3]));
    let facets = Conductor { fresnel };
    let ndf = table.normals::<f64>();
    let wi = Vector3::spherical(0.4, 0.0);
    let albedo = |seed, sample: &mut dyn FnMut(&mut Stream<Pcg64Mcg>) -> Option<Exit<f64>>| {
        let (mut rng, mut mean) = (stream(seed), Mean::default());
        (0..60_000).for_each(|_| mean.add(sample(&mut rng).map_or(0.0, |e| e.weight.0[1])));
        mean
    };
    let ours = albedo(1, &mut |rng| Microsurface { ndf, facets }.sample(wi, rng));
    let theirs = albedo(2, &mut |rng| {
        Microsurface { ndf: exact, facets }.sample(wi, rng)
    });
    let score = ours.score_against(&theirs);
    assert!(score.abs() < BOUND, "{ours:?} {theirs:?}");
}

#[test]
fn single_precision_is_double_precision_rounded() {
    let table = ggx(0.5, 64);
    for w in views() {
        let small = Vector3::new(w.x as f32, w.y as f32, w.z as f32);
        let back = [small.x, small.y, small.z].map(f64::from);
        let back = Vector3::new(back[0], back[1], back[2]);
        let area = f64::from(table.normals::<f32>().projected_area(small));
        let exact = table.normals::<f64>().projected_area(back);
        assert!((area / exact - 1.0).abs() < 1e-6, "{w:?}: {area} {exact}");
    }
}

#[test]
fn what_is_no_table_is_refused() {
    use NormalTableError::{Count, Density, Edge};
    let refused = |edges: &[f64], densities: &[f64]| NormalTable::new(edges, densities).err();
    assert!(matches!(refused(&[0.0, 1.0], &[]), Some(Count { .. })));
    assert_eq!(refused(&[0.1, 1.0], &[1.0]), Some(Edge(0)));
    assert_eq!(refused(&[0.0, 1.0, 0.5], &[1.0, 1.0]), Some(Edge(2)));
    assert_eq!(refused(&[0.0, 1.6], &[1.0]), Some(Edge(1)));
    assert_eq!(refused(&[0.0, f64::NAN], &[1.0]), Some(Edge(1)));
    assert_eq!(refused(&[0.0, 1.0], &[-1.0]), Some(Density(0)));
    assert_eq!(refused(&[0.0, 1.0], &[f64::NAN]), Some(Density(0)));
    assert_eq!(refused(&[0.0, 1.0], &[0.0]), Some(Density(0)));
}
