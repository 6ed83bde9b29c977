//! Error against time: the command as users run it, and the two estimates of
//! noise held to true errors, on the gold sphere at a few pixels.

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;
use smithwalk::description::Description;
use smithwalk::report::converge::{Plan, Reference, View, measure};
use smithwalk::scene::{Resolved, resolve};

const SCENE: &str = "scenes/gold_sphere/scene.yaml";

/// The gold sphere at 32 × 32 pixels.
fn small_scene() -> Resolved {
    let overrides = ["film.width", "film.height"].map(|path| (path.to_owned(), "32".to_owned()));
    let description = Description::load(Path::new(SCENE), &overrides).unwrap();
    resolve(&description).unwrap()
}

fn view(small: &Resolved) -> View<'_> {
    View::new(&small.scene, &small.settings).unwrap()
}

/// A folder of its own, removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let name = format!("smithwalk-converge-{}-{name}", std::process::id());
        let path = std::env::temp_dir().join(name);
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn path(&self, name: &str) -> String {
        self.0.join(name).to_str().unwrap().to_owned()
    }

    fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.0.join(name)).unwrap()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// The film's estimate misses what the halves of the samples gain together, and so
/// errs on the large side: by nothing for independent samples, by √(2^1.5 − 1) = 1.35
/// where most of the noise comes from jumps in two dimensions, as here from the outline
/// of the sphere. Around that the bounds allow for chance: 3072 channels of kurtosis
/// below 30 put the standard error of the true relMSE at a tenth at most, hence of the
/// error itself at 0.05; three of those.
#[test]
fn the_noise_estimate_agrees_with_the_true_error() {
    let scene = small_scene();
    let view = view(&scene);
    let reference = Reference::render(&view, 4096, 1 << 40);
    for seed in [1, 2] {
        let mut film = view.film();
        for spp in [16, 64] {
            view.render(&mut film, seed, spp);
            let estimated = film.relative_error().unwrap();
            let actual = reference.rel_mse(&film.develop().color).sqrt();
            let ratio = estimated / actual;
            println!("{spp} spp: estimated {estimated:.5}, true {actual:.5}, ratio {ratio:.3}");
            assert!(
                (0.85..1.55).contains(&ratio),
                "{spp} spp: {estimated} for {actual}"
            );
        }
    }
}

/// What a reference says of its own noise, against a far better one.
#[test]
fn the_floor_is_the_noise_of_the_reference() {
    let scene = small_scene();
    let view = view(&scene);
    let better = Reference::render(&view, 4096, 1 << 40);
    let mut halves = [3, 4].map(|seed| {
        let mut film = view.film();
        view.render(&mut film, seed, 16);
        film.develop().color
    });
    let reference = Reference::render(&view, 32, 3);
    let [a, b] = &mut halves;
    for (a, b) in a.as_flattened_mut().iter_mut().zip(b.as_flattened()) {
        *a = 0.5 * (*a + b);
    }
    let (floor, actual) = (reference.floor.unwrap(), better.rel_mse(a));
    println!("floor {floor:.6}, true {actual:.6}");
    assert!((floor / actual - 1.0).abs() < 0.3, "{floor} for {actual}");
    assert!(
        (reference.rel_mse(a) + floor).abs() < 1e-9,
        "not the mean of the halves"
    );
}

/// With its noise subtracted, a poor reference measures what a good one does.
#[test]
fn errors_do_not_depend_on_the_noise_of_the_reference() {
    let scene = small_scene();
    let view = view(&scene);
    let plan = Plan {
        spp: 8,
        seeds: vec![1, 2],
    };
    let last = |spp, seed| {
        let reference = Reference::render(&view, spp, seed);
        let (runs, _) = measure("a", &view, &reference, &plan);
        runs.last().unwrap().rel_mse
    };
    // What one poor reference says of its noise is noisy itself.
    let poor = (0..4)
        .map(|k| last(32, (1 << 40) + 2 * (k + 1)))
        .sum::<f64>()
        / 4.0;
    let good = last(4096, 1 << 40);
    println!("{poor:.6} by 32 spp, {good:.6} by 4096 spp");
    assert!((poor / good - 1.0).abs() < 0.15, "{poor}, not {good}");

    // Without subtraction it would have been off by a quarter.
    let raw = Reference::render(&view, 32, 1 << 40);
    assert!(raw.floor.unwrap() > 0.15 * good);
}

#[test]
fn the_command_writes_runs_summary_and_charts() {
    let folder = Folder::new("command");
    let peer = folder.path("peer.csv");
    std::fs::write(
        &peer,
        "name,spp,wall_s,cpu_s,rel_mse\nSomeone else,8,0.1,0.2,1e-2\n",
    )
    .unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_smithwalk"))
        .args([
            "converge",
            SCENE,
            "-D",
            "film.width=24",
            "-D",
            "film.height=24",
            // The first samples decide on the branches of the rest, and so
            // bend the slope of few.
            "-D",
            "sampling.branches=1",
        ])
        .args(["--spp", "8", "--seeds", "2", "--reference-spp", "512"])
        .args(["--estimators", "auto,walk,single", "--peer", &peer])
        .args(["-o", &folder.path("out")])
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(
        output.status.success(),
        "{text}{}",
        String::from_utf8_lossy(&output.stderr)
    );
    println!("{text}");

    let runs = folder.read("out/runs.csv");
    assert!(
        runs.starts_with("name,spp,seed,wall_s,cpu_s,rel_mse\n"),
        "{runs}"
    );
    // Three estimators, two seeds, 1 to 8 samples, and the peer.
    assert_eq!(runs.lines().count(), 1 + 3 * 2 * 4 + 1);

    let summary: Value = serde_json::from_str(&folder.read("out/summary.json")).unwrap();
    let curves = summary["curves"].as_array().unwrap();
    let curve = |name| curves.iter().find(|c| c["name"] == name).unwrap();
    for name in ["auto", "walk", "single"] {
        let curve = curve(name);
        let slope = curve["by"]["spp"]["slope"].as_f64().unwrap();
        assert!((-1.6..-0.7).contains(&slope), "{name}: {slope}");
        assert!(curve["tails"]["kurtosis"].as_f64().unwrap() > 1.0);
        assert!(curve["floor"].as_f64().unwrap() > 0.0);
    }
    // Single scattering loses light on rough gold; the model does not.
    assert!(curve("single")["bias"].as_f64().unwrap() > 1e-3);
    assert!(curve("auto")["bias"].is_null());
    assert_eq!(curve("Someone else")["points"].as_array().unwrap().len(), 1);

    for chart in ["error-spp.svg", "error-wall.svg", "error-cpu.svg"] {
        let svg = folder.read(&format!("out/{chart}"));
        assert!(svg.contains("Someone else") && svg.contains("bias of single"));
    }
}

#[test]
fn a_bad_peer_stops_the_command_before_it_renders() {
    let folder = Folder::new("bad-peer");
    let peer = folder.path("peer.csv");
    std::fs::write(&peer, "name,spp,wall_s,cpu_s,rel_mse\nX,8,0,0.2,1e-2\n").unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_smithwalk"))
        .args([
            "converge",
            SCENE,
            "--peer",
            &peer,
            "-o",
            &folder.path("out"),
        ])
        .output()
        .unwrap();
    assert!(!output.status.success());
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(text.contains("peer.csv:2: wall_s is 0"), "{text}");
    assert!(!folder.0.join("out").exists());
}
