//! The renderer as a whole: what an image does and does not depend on, and the
//! gold sphere against Cycles.

use std::collections::BTreeSet;
use std::path::Path;

use crate::common::{Settings, film, image, load};
use smithwalk::film::Aov;
use smithwalk::image::{Window, read_exr};
use smithwalk::integrator::{KERNELS, kernel_for};
use smithwalk::metrics::{mean, rel_bias, rel_bias_trimmed};

const GOLD: &str = "scenes/gold_sphere/scene.yaml";

/// The scene files of the repository.
fn scenes() -> Vec<std::path::PathBuf> {
    let mut files: Vec<_> = std::fs::read_dir("scenes")
        .expect("scenes are there")
        .map(|entry| entry.expect("readable").path().join("scene.yaml"))
        .filter(|path| path.exists())
        .collect();
    files.sort();
    assert!(files.len() >= 2, "{files:?}");
    files
}

/// A few pixels in the middle, so that every scene takes part in little time.
fn middle([width, height]: [u32; 2]) -> Window {
    let size = 48.min(width).min(height);
    Window {
        x: (width - size) / 2,
        y: (height - size) / 2,
        width: size,
        height: size,
    }
}

/// So many threads to render with.
fn threads(number: usize) -> rayon::ThreadPool {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(number);
    pool.build().expect("a pool")
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let render = |number| {
        let settings = Settings {
            window: Some(Window {
                x: 90,
                y: 90,
                width: 70,
                height: 50,
            }),
            ..Settings::spp(8)
        };
        threads(number).install(|| image(Path::new(GOLD), &[], settings, &[]))
    };
    assert_eq!(render(1).color, render(3).color);
}

#[test]
fn a_seed_is_an_image() {
    let render = |seed| {
        let window = Some(Window {
            x: 100,
            y: 100,
            width: 32,
            height: 32,
        });
        image(
            Path::new(GOLD),
            &[],
            Settings {
                seed,
                window,
                ..Settings::spp(4)
            },
            &[],
        )
    };
    assert_eq!(render(7).color, render(7).color);
    assert_ne!(render(7).color, render(8).color);
}

/// Changes to the gold sphere that leave out more than any scene of the
/// repository does, or that have what none has: walks on Beckmann metal, for several
/// directions at once and for one.
const PLAINER: &[&[(&str, &str)]] = &[
    &[
        ("lights", "[]"),
        ("materials.gold", "{diffuse: {color: 0.8}}"),
    ],
    &[("sampling.estimator", "single")],
    &[("materials.gold", BECKMANN)],
    &[("materials.gold", BECKMANN), ("sampling.branches", "1")],
    &[(
        "materials.gold",
        "{principled: {version: 5.0, roughness: 0.3, coat_weight: 0.5}}",
    )],
    &[(
        "materials.gold",
        "{openpbr: {coat_weight: 0.5, fuzz_weight: 0.5}}",
    )],
];

const BECKMANN: &str = "{conductor: {alpha: 0.5, distribution: beckmann}}";

/// The leanest kernel on one thread and the one with everything on three give the
/// same bits on every scene of the repository. These and a few plainer ones take all
/// the kernels there are, and none of them needs the one with everything.
#[test]
fn leaving_features_out_changes_no_bit() {
    let plainer = PLAINER.iter().map(|changes| (GOLD.into(), *changes));
    let scenes = scenes().into_iter().map(|path| (path, &[][..]));
    let [one, three] = [1, 3].map(threads);
    let mut kernels = BTreeSet::new();
    for (path, changes) in scenes.chain(plainer) {
        let loaded = load(&path, changes);
        kernels.insert(kernel_for(loaded.scene.features));
        let settings = Settings {
            window: Some(middle(loaded.settings.resolution)),
            ..Settings::spp(1)
        };
        let [lean, full] = [(&one, false), (&three, true)].map(|(threads, all_in)| {
            let settings = Settings { all_in, ..settings };
            threads.install(|| film(&loaded, settings, &[]).develop().color)
        });
        assert_eq!(lean, full, "{} {changes:?}", path.display());
    }
    assert!(kernels.into_iter().eq(0..KERNELS.len() - 1));
}

#[test]
fn single_and_multiple_scattering_add_up_to_the_image() {
    let window = Some(Window {
        x: 90,
        y: 80,
        width: 64,
        height: 64,
    });
    let settings = Settings {
        window,
        ..Settings::spp(8)
    };
    let image = image(
        Path::new(GOLD),
        &[],
        settings,
        &[Aov::Single, Aov::Multiple],
    );
    let layer = |aov: Aov| {
        image
            .layer(aov.name())
            .and_then(|l| l.rgb())
            .expect("asked for")
    };
    let (single, multiple) = (layer(Aov::Single), layer(Aov::Multiple));
    for ((all, a), b) in image.color.iter().zip(&single).zip(&multiple) {
        for c in 0..3 {
            assert!((all[c] - (a[c] + b[c])).abs() <= 1e-5 * all[c].max(1.0));
        }
    }
    let share = mean(&multiple)[0] / mean(&image.color)[0];
    assert!(
        (0.05..0.6).contains(&share),
        "multiple scattering is {share} of a rough gold sphere"
    );
}

/// Multiple scattering against the random walk of Cycles 3.4, whose images have
/// rare huge outliers: hence the robust means, and five seeds in the reference.
/// The bound of 0.5 % leaves room for how that walk departs from the model (up
/// to 0.4 % in green here); noise is below 0.05 %.
#[test]
fn the_gold_sphere_agrees_with_the_random_walk_of_cycles() {
    let ours = image(
        Path::new(GOLD),
        &[("materials.gold.conductor.roughness", "0.5")],
        Settings::spp(48),
        &[],
    );
    let theirs = read_exr(Path::new(
        "scenes/gold_sphere/cycles_3.4_multi_ggx_r0.5.exr",
    ))
    .expect("reads");
    let bias = rel_bias_trimmed(&ours.color, &theirs.color);
    assert!(bias.abs() < 5e-3, "robust relative bias {bias}");
    assert!(bias != 0.0, "two renderers never agree to the last bit");
}

/// Single scattering against Cycles 4.5's height-correlated GGX, the same
/// model: within 0.3 %.
#[test]
fn single_scattering_agrees_with_cycles() {
    for roughness in ["0.5", "0.8"] {
        let ours = image(
            Path::new(GOLD),
            &[
                ("materials.gold.conductor.roughness", roughness),
                ("sampling.estimator", "single"),
            ],
            Settings::spp(32),
            &[],
        );
        let file = format!("scenes/gold_sphere/cycles_4.5_ggx_r{roughness}.exr");
        let theirs = read_exr(Path::new(&file)).expect("reads");
        for (bias, name) in [
            (rel_bias(&ours.color, &theirs.color), "plain"),
            (rel_bias_trimmed(&ours.color, &theirs.color), "robust"),
        ] {
            assert!(
                bias.abs() < 3e-3,
                "roughness {roughness}: {name} relative bias {bias}"
            );
        }
    }
}

/// The mean over the middle of an image and its squared standard error, by these seeds.
fn mean_of_seeds(
    scene: &str,
    changes: &[(&str, &str)],
    spp: u32,
    seeds: std::ops::Range<u64>,
) -> (f64, f64) {
    let loaded = load(Path::new(scene), changes);
    let window = Some(middle(loaded.settings.resolution));
    let means: Vec<f64> = seeds
        .map(|seed| {
            let settings = Settings {
                seed,
                window,
                ..Settings::spp(spp)
            };
            mean(&film(&loaded, settings, &[]).develop().color)
                .iter()
                .sum::<f64>()
        })
        .collect();
    let n = means.len() as f64;
    let mean = means.iter().sum::<f64>() / n;
    let squares: f64 = means.iter().map(|value| (value - mean).powi(2)).sum();
    (mean, squares / (n * (n - 1.0)))
}

/// Two means over 24 seeds each that differ by less than 3.5 standard errors: a false
/// alarm in 1000 at 46 degrees of freedom. They must be known to a share of `known`.
fn assert_same_light((one, a): (f64, f64), (other, b): (f64, f64), known: f64) {
    let z = (one - other) / (a + b).sqrt();
    assert!(z.abs() < 3.5, "{one} against {other}: {z} standard errors");
    let error = (a + b).sqrt() / other;
    assert!(error < known, "too noisy to tell: {error}");
}

/// Paths that end by what they may yet add find as much light as paths that go on, in a
/// part of a room that other surfaces light. Seen failing at survivors whose weight is
/// not raised.
#[test]
fn roulette_keeps_the_light_of_a_room() {
    let room = "scenes/interior/scene.yaml";
    let ending = mean_of_seeds(room, &[], 2, 0..24);
    let lasting = mean_of_seeds(room, &[("sampling.roulette_start", "64")], 2, 24..48);
    assert_same_light(ending, lasting, 0.02);
}

/// Paths that split find as much light of an environment as plain ones, though they
/// weigh light samples by how many branches they have beside them. Seen failing at
/// branches that are weighed by density alone.
#[test]
fn splitting_keeps_the_light_of_an_environment() {
    let metal = "scenes/brushed_metal/scene.yaml";
    let split = mean_of_seeds(metal, &[], 2, 0..24);
    let plain = mean_of_seeds(metal, &[("sampling.branches", "1")], 16, 24..48);
    assert_same_light(split, plain, 0.003);
}
