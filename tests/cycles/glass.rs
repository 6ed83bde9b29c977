//! Reflectance and transmittance of rough glass against Blender's Cycles,
//! from outside and from inside (`tests/data`): 3.4.1's walk and 4.5's single
//! scattering. Where either departs from the model, a variant of the model
//! with Cycles' shortcuts agrees: the difference is explained, not tolerated.
//!
//! Both sides have Monte Carlo errors, from the scatter of 16 pixels in
//! Cycles (up to 0.001 for the walk from inside) and of 16 scrambled Sobol
//! sets here.

use rayon::prelude::*;
use smithwalk_model::*;

use crate::cycles::judged::{Summary, worst_score};
use crate::cycles::measured::{Glass, Mean, Points, means, rows};
use crate::cycles::shortcuts;

/// Cycles and its counterpart here may differ by this, noise included, where
/// the noise lets them: in rows whose error is a quarter of it at most.
const BAR: f64 = 0.002;

fn surface<N>(row: &Glass, ndf: N) -> Microsurface<N, Dielectric<f64>> {
    Microsurface {
        ndf,
        facets: Dielectric {
            eta: row.eta(),
            tint: Rgb::white(),
        },
    }
}

/// Reflected and transmitted.
fn sides(exit: Option<Exit<f64>>) -> [f64; 2] {
    match exit {
        Some(exit) if exit.direction.z > 0.0 => [exit.weight.0[0], 0.0],
        Some(exit) => [0.0, exit.weight.0[0]],
        None => [0.0; 2],
    }
}

/// A row of Cycles, with a variant's reflectance and transmittance and the
/// model's.
struct Compared {
    row: Glass,
    variant: [Mean; 2],
    exact: [Mean; 2],
}

/// All rows of one file and distribution; `sample` gives the variant's and the
/// model's light.
fn compare(
    file: &str,
    distribution: &str,
    points: u32,
    sample: impl Fn(&Glass, Vector3<f64>, &mut Points) -> [[f64; 2]; 2] + Sync,
) -> Vec<Compared> {
    let mut rows: Vec<Glass> = rows(file);
    rows.retain(|row| row.distribution == distribution);
    let compared = rows.into_par_iter().map(|row| {
        let wi = Vector3::spherical(row.cos, 0.3);
        let [a, b, c, d] = means(points, |rng| {
            let [[a, b], [c, d]] = sample(&row, wi, rng);
            [a, b, c, d]
        });
        Compared {
            row,
            variant: [a, b],
            exact: [c, d],
        }
    });
    let compared: Vec<_> = compared.collect();
    assert_eq!(compared.len(), 120);
    compared
}

/// The differences of reflectance (0) or transmittance (1) from Cycles', in
/// the rows of one side.
fn differences(
    compared: &[Compared],
    side: &str,
    part: usize,
    of: fn(&Compared) -> [Mean; 2],
) -> Vec<(String, Mean)> {
    let rows = compared.iter().filter(|c| c.row.side == side);
    rows.map(|c| {
        let row = &c.row;
        (row.name(), of(c)[part].above(row.measured()[part]))
    })
    .collect()
}

/// The variant is Cycles', on both sides: quiet rows within the bar, all
/// within the bound on the scores, and no trend below that. Returns how many
/// were quiet.
fn agrees(compared: &[Compared]) -> usize {
    let mut quiet = 0;
    for side in ["outside", "inside"] {
        for part in [0, 1] {
            let all = differences(compared, side, part, |c| c.variant);
            let summary = Summary::of(&all);
            println!("{side}, {}: {summary}", ["r", "t"][part]);
            assert!(summary.score <= worst_score(4 * all.len()));
            assert!(summary.chi_square < 1.8);
            for (name, d) in all.iter().filter(|(_, d)| d.error <= BAR / 4.0) {
                quiet += 1;
                assert!(d.value.abs() <= BAR, "{name}: {d:?}");
            }
        }
    }
    quiet
}

#[test]
fn walks_with_its_shortcuts_are_those_of_cycles_3_4() {
    let file = "cycles_3.4_albedo_dielectric.csv";
    let compared = compare(file, "MULTI_GGX", 8192, |row, wi, rng| {
        let surface = surface(row, Ggx::isotropic(row.roughness * row.roughness));
        let variant = shortcuts::walk(&surface, wi, &mut rng.clone());
        [variant, surface.sample(wi, rng)].map(sides)
    });
    let quiet = agrees(&compared);
    println!("{quiet} of 240 figures held to {BAR}");
    assert!(quiet >= 120);

    // The model loses nothing, and is elsewhere: most of all from inside.
    for c in &compared {
        let [r, t] = c.exact;
        let sum = r.value + t.value;
        assert!((sum - 1.0).abs() < 1e-12, "{}: {sum}", c.row.name());
    }
    let outside = Summary::of(&differences(&compared, "outside", 0, |c| c.exact));
    let inside = Summary::of(&differences(&compared, "inside", 0, |c| c.exact));
    println!("the exact walk: {outside} {inside}");
    assert!((0.005..0.012).contains(&outside.worst));
    assert!((0.13..0.15).contains(&inside.worst));
    // An independent implementation of the model in numpy, three digits.
    let found = compared.iter().find(|c| {
        let r = &c.row;
        (r.roughness, r.side.as_str(), r.cos) == (1.0, "inside", 0.5)
    });
    let r = found.expect("the row is there").exact[0];
    assert!((r.value - 0.656).abs() < 0.001 + 5.0 * r.error, "{r:?}");
}

#[test]
fn single_scattering_is_that_of_cycles_4_5_but_for_the_masking_of_refraction() {
    let file = "cycles_4.5_albedo_dielectric.csv";
    let ggx = compare(file, "GGX", 4096, |row, wi, rng| {
        let surface = surface(row, Ggx::isotropic(row.roughness * row.roughness));
        let variant = shortcuts::single(&surface, wi, &mut rng.clone());
        [variant, surface.sample_single(wi, rng)].map(sides)
    });
    let quiet = agrees(&ggx);
    println!("{quiet} of 240 figures held to {BAR}");
    assert!(quiet >= 200);

    // Beckmann's Λ is approximated there: no scores.
    let beckmann = compare(file, "BECKMANN", 4096, |row, wi, rng| {
        let surface = surface(row, Beckmann::isotropic(row.roughness * row.roughness));
        let variant = shortcuts::single(&surface, wi, &mut rng.clone());
        [variant, surface.sample_single(wi, rng)].map(sides)
    });
    for side in ["outside", "inside"] {
        for part in [0, 1] {
            let all = Summary::of(&differences(&beckmann, side, part, |c| c.variant));
            println!("Beckmann {side}, {}: {all}", ["r", "t"][part]);
            assert!(all.worst <= BAR);
        }
    }

    // Reflection is the model's as it is. Of refracted light Cycles lets more
    // through, most of all into rough glass at grazing incidence.
    for (compared, most) in [(&ggx, 0.6), (&beckmann, 0.4)] {
        for side in ["outside", "inside"] {
            let r = Summary::of(&differences(compared, side, 0, |c| c.exact));
            assert!(r.worst <= BAR, "{r}");
            let t = differences(compared, side, 1, |c| c.exact);
            for (name, t) in &t {
                assert!(t.value <= BAR, "{name}: {t:?}");
            }
            let t = Summary::of(&t);
            println!("the model's refraction, {side}: {t}");
            assert!(side == "inside" || t.worst > most);
        }
    }
}
