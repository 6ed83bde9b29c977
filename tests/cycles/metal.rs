//! Directional albedos of rough metal against Blender's Cycles, measured there
//! with a plane in a white world (`tests/data`): 3.4.1, among the last that
//! walk, and 4.5, whose single scattering is the model's.
//!
//! Both sides have Monte Carlo errors. Cycles' come from the scatter of 16
//! pixels of 8192 samples: at most 3.7e-4, in the median below 1e-4. Ours come
//! from that of 16 scrambled Sobol sets.

use rayon::prelude::*;
use smithwalk_model::*;

use crate::cycles::judged::{Summary, worst_score};
use crate::cycles::measured::{GOLD, Mean, Metal, means, rows};
use crate::cycles::shortcuts;

/// Cycles and its counterpart here may differ by this, noise included.
const BAR: f64 = 0.002;

/// Albedos of gold in the green channel by an implementation of the exact
/// model in numpy, and by Cycles 3.4.1: √α, cosθ, both.
const GREEN: [(f64, f64, f64, f64); 9] = [
    (0.5, 0.999, 0.6908, 0.6910),
    (0.5, 0.5, 0.6782, 0.6786),
    (0.5, 0.1, 0.6869, 0.6871),
    (0.7, 0.999, 0.6352, 0.6375),
    (0.7, 0.5, 0.6392, 0.6421),
    (0.7, 0.1, 0.6798, 0.6806),
    (1.0, 0.999, 0.4916, 0.5079),
    (1.0, 0.5, 0.5566, 0.5674),
    (1.0, 0.1, 0.6548, 0.6574),
];

/// Rounding and noise of these, in sum.
const TABLE_ERROR: f64 = 0.0006;

fn gold<N>(ndf: N) -> Microsurface<N, Conductor<f64>> {
    let fresnel = ConductorFresnel::Constant(Rgb(GOLD));
    Microsurface {
        ndf,
        facets: Conductor { fresnel },
    }
}

/// Red and green, which all rows are compared in.
fn seen(exit: Option<Exit<f64>>) -> [f64; 2] {
    exit.map_or([0.0; 2], |exit| [exit.weight.0[0], exit.weight.0[1]])
}

/// A row of 3.4's Multiscatter GGX, and the walks from the same direction.
struct Walked {
    row: Metal,
    /// With Cycles' shortcuts.
    shortcut: [Mean; 2],
    /// The model.
    exact: [Mean; 2],
}

fn walked() -> Vec<Walked> {
    const POINTS: u32 = 2048;
    let rows: Vec<Metal> = rows("cycles_3.4_albedo_conductor.csv");
    let walks = rows.into_par_iter().filter_map(|row| {
        if row.distribution != "MULTI_GGX" {
            return None;
        }
        let (alpha_x, alpha_y) = row.alpha();
        let (surface, wi) = (gold(Ggx { alpha_x, alpha_y }), row.view());
        let [a, b, c, d] = means(POINTS, |rng| {
            let [a, b] = seen(shortcuts::walk(&surface, wi, &mut rng.clone()));
            let [c, d] = seen(surface.sample(wi, rng));
            [a, b, c, d]
        });
        Some(Walked {
            row,
            shortcut: [a, b],
            exact: [c, d],
        })
    });
    walks.collect()
}

#[test]
fn walks_with_its_shortcuts_are_those_of_cycles_3_4() {
    let walked = walked();
    let difference = |of: fn(&Walked) -> Mean| -> Summary {
        let rows = walked.iter().map(|w| {
            let [_, green] = w.row.measured();
            (w.row.name(), of(w).above(green))
        });
        Summary::of(&rows.collect::<Vec<_>>())
    };

    // With its shortcuts the walk is Cycles', in every row.
    let shortcut = difference(|w| w.shortcut[1]);
    println!("with the shortcuts: {shortcut}");
    assert_eq!(shortcut.count, 330);
    assert!(shortcut.worst <= BAR);
    assert!(shortcut.score <= worst_score(shortcut.count));
    assert!(shortcut.chi_square < 1.5);

    // Without them it is not, and the comparison sees that.
    let exact = difference(|w| w.exact[1]);
    println!("the exact walk: {exact}");
    assert!(exact.worst > 8.0 * BAR && exact.chi_square > 20.0);

    // White metal loses nothing, here or there.
    for Walked {
        row,
        shortcut,
        exact,
    } in &walked
    {
        let name = row.name();
        assert!((exact[0].value - 1.0).abs() < 1e-12, "{name}: {exact:?}");
        let [red, _] = row.measured();
        assert!((red.value - 1.0).abs() < 2e-5, "{name}: {red:?}");
        assert!((shortcut[0].value - 1.0).abs() < 2e-5, "{name}");
    }

    // The exact walk is an independent implementation's, and its difference
    // from Cycles is the one that was found with that.
    for (roughness, cos, exact, cycles) in GREEN {
        let w = walked.iter().find(|w| {
            let r = &w.row;
            (r.roughness, r.anisotropy, r.cos) == (roughness, 0.0, cos)
        });
        let w = w.unwrap_or_else(|| panic!("no row r {roughness} cosθ {cos}"));
        let ours = w.exact[1];
        let allowed = TABLE_ERROR + 5.0 * ours.error;
        assert!(
            (ours.value - exact).abs() < allowed,
            "{ours:?}, not {exact}"
        );
        let [_, green] = w.row.measured();
        let excess = green.value - ours.value;
        let allowed = TABLE_ERROR + 5.0 * ours.error.hypot(green.error);
        assert!(
            (excess - (cycles - exact)).abs() < allowed,
            "r {roughness} cosθ {cos}: Cycles 3.4 is too bright by {excess}"
        );
    }
}

/// All rows of single scattering of 4.5, isotropic and anisotropic.
fn single<N: Ndf<Scalar = f64>>(distribution: &str, ndf: fn(f64, f64) -> N) -> Summary {
    const POINTS: u32 = 2048;
    let mut rows: Vec<Metal> = rows("cycles_4.5_albedo_conductor.csv");
    rows.retain(|row| row.distribution == distribution);
    let differences = rows.par_iter().flat_map_iter(|row| {
        let (alpha_x, alpha_y) = row.alpha();
        let (surface, wi) = (gold(ndf(alpha_x, alpha_y)), row.view());
        let ours = means(POINTS, |rng| seen(surface.sample_single(wi, rng)));
        let channels = ours.into_iter().zip(row.measured());
        channels.map(|(ours, cycles)| (row.name(), ours.above(cycles)))
    });
    let summary = Summary::of(&differences.collect::<Vec<_>>());
    println!("{distribution}: {summary}");
    assert_eq!(summary.count, 660);
    assert!(summary.worst <= BAR);
    summary
}

#[test]
fn single_scattering_is_that_of_cycles_4_5() {
    let ggx = single("GGX", |alpha_x, alpha_y| Ggx { alpha_x, alpha_y });
    assert!(ggx.score <= worst_score(ggx.count) && ggx.chi_square < 1.5);
    // Cycles has a rational approximation for Beckmann's Λ, which is off by
    // up to 0.0005 of albedo, far above the noise: no scores there.
    single("BECKMANN", |alpha_x, alpha_y| Beckmann { alpha_x, alpha_y });
}
