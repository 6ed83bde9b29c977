//! The explicit surface against the model.

use smithwalk::report::heightfield::{
    Config, Departure, HeightCase, LobeCase, outgoing_lobes, visible_heights,
};

/// Prints what `docs/explicit-surface.md` tabulates. Takes minutes:
/// `cargo test --release --test heightfield -- --ignored --nocapture`, with
/// PATCH, CELLS, REALISATIONS, RAYS, SEED in the environment.
#[test]
#[ignore = "prints a study, for minutes"]
fn study() {
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
    let begin = std::time::Instant::now();
    for case in visible_heights(&config).expect("a surface") {
        print_heights(&case);
    }
    println!("heights: {:.1} s", begin.elapsed().as_secs_f64());
    let begin = std::time::Instant::now();
    for case in outgoing_lobes(&config).expect("a surface") {
        print_lobes(&case);
    }
    println!("lobes: {:.1} s", begin.elapsed().as_secs_f64());
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
        "{:<31} α {:?} z {:5.2}: KS {} %  hits {:.4} ± {:.4} model {:.4}  lost {}",
        case.name,
        case.alpha,
        case.travel_z,
        percent(&case.departure),
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
