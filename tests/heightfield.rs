//! The explicit surface against the model.

use smithwalk::report::heightfield::{
    Config, Departure, HeightCase, LobeCase, outgoing_lobes, visible_heights,
};

/// The chance that the family of all comparisons fails for a model that
/// departs as tabulated.
const FALSE_ALARM: f64 = 1e-4;

/// Šidák's share of it for one of `count` comparisons.
fn of_each(count: usize) -> f64 {
    -((-FALSE_ALARM).ln_1p() / count as f64).exp_m1()
}

#[test]
fn heights_depart_from_the_model_no_more_than_tabulated() {
    let cases = visible_heights(&Config::quick()).expect("a surface");
    let departures: Vec<Departure> = cases.iter().flat_map(|c| [c.heights, c.reach]).collect();
    let each = of_each(departures.len());
    for case in &cases {
        assert_eq!(case.lost, 0, "{}", case.name);
        assert!(
            case.heights.holds(each) && case.reach.holds(each),
            "{case:#?}"
        );
    }
    // Where rays begin above the surface and go down, all of them hit.
    assert!(cases[..6].iter().all(|c| c.hits.value == 1.0));
}

#[test]
fn lobes_depart_from_the_model_no_more_than_tabulated() {
    let cases = outgoing_lobes(&Config::quick()).expect("a surface");
    let each = of_each(3 * cases.len());
    for case in &cases {
        let what = format!("{:?} α {:?} cos {}", case.facets, case.alpha, case.cos);
        assert_eq!(case.lost, 0, "{what}");
        for departure in [case.shares, case.single, case.multiple] {
            assert!(departure.holds(each), "{what}: {departure:?}");
        }
        let energy: f64 = case.lobes.iter().map(|l| l.share.value).sum();
        assert!((energy - 1.0).abs() < 1e-9, "{what}: {energy} came out");
    }
}

#[test]
fn results_depend_on_the_seed_alone() {
    let config = Config {
        patch: 4.0,
        realisations: 2,
        rays: 50,
        ..Config::quick()
    };
    let once = outgoing_lobes(&config).expect("a surface");
    assert_eq!(once, outgoing_lobes(&config).expect("a surface"));
    let other = Config { seed: 9, ..config };
    assert_ne!(once, outgoing_lobes(&other).expect("a surface"));
}

#[test]
fn a_configuration_without_a_surface_is_an_error() {
    let config = Config {
        patch: f64::NAN,
        ..Config::quick()
    };
    let error = visible_heights(&config).expect_err("no surface");
    assert!(error.to_string().contains("patch: NaN"), "{error}");
}

/// Prints what `docs/explicit-surface.md` tabulates, with PATCH, CELLS,
/// REALISATIONS, RAYS, WALKS and SEED from the environment.
#[test]
#[ignore = "prints a study, for minutes"]
fn study_of_heights() {
    for case in visible_heights(&from_environment()).expect("a surface") {
        print_heights(&case);
    }
}

/// See [`study_of_heights`].
#[test]
#[ignore = "prints a study, for minutes"]
fn study_of_lobes() {
    for case in outgoing_lobes(&from_environment()).expect("a surface") {
        print_lobes(&case);
    }
}

fn from_environment() -> Config {
    let number = |name: &str, default: f64| -> f64 {
        std::env::var(name).map_or(default, |v| v.parse().expect("a number"))
    };
    let standard = Config::standard();
    let config = Config {
        patch: number("PATCH", standard.patch),
        cells: number("CELLS", standard.cells),
        realisations: number("REALISATIONS", standard.realisations as f64) as usize,
        rays: number("RAYS", standard.rays as f64) as usize,
        walks_per_ray: number("WALKS", standard.walks_per_ray as f64) as usize,
        seed: number("SEED", standard.seed as f64) as u64,
    };
    println!("{config:?}");
    config
}

fn percent(d: &Departure) -> String {
    format!(
        "{:.2} ± {:.2} (noise {:.2})",
        100.0 * d.value,
        100.0 * d.error,
        100.0 * d.noise
    )
}

fn print_heights(case: &HeightCase) {
    println!(
        "{:<31} α {} z {:5.2}: heights {} reach {} %  hits {:.4} ± {:.4} model {:.4}  lost {}",
        case.name,
        case.alpha,
        case.travel_z,
        percent(&case.heights),
        percent(&case.reach),
        case.hits.value,
        case.hits.error,
        case.hits_model,
        case.lost
    );
}

fn print_lobes(case: &LobeCase) {
    println!(
        "{:?} α {:?} cos {}: shares {} single {} multiple {} %  lost {}",
        case.facets,
        case.alpha,
        case.cos,
        percent(&case.shares),
        percent(&case.single),
        percent(&case.multiple),
        case.lost
    );
    for lobe in &case.lobes {
        println!(
            "    {} {}: {:.4} ± {:.4}  model {:.4} ± {:.4}",
            if lobe.transmitted { "T" } else { "R" },
            lobe.order,
            lobe.share.value,
            lobe.share.error,
            lobe.share_model.value,
            lobe.share_model.error
        );
    }
}
