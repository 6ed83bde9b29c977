//! `render --denoise`. `./setup.sh --with-denoiser`, which `./test.sh` calls, fetches the
//! library; without it what is told is tested, and nothing else can be.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use smithwalk::embree::{DenoiseError, Denoiser, Guides};
use smithwalk::image::{Image, read_exr};

const SCENE: &str = "scenes/gold_sphere/scene.yaml";

fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&path);
    std::fs::create_dir_all(&path).unwrap();
    path
}

fn render(output: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_smithwalk"))
        .args([
            "render",
            SCENE,
            "-D",
            "film.width=96",
            "-D",
            "film.height=96",
            "-D",
            "sampling.branches=1",
        ])
        .arg("-o")
        .arg(output)
        .args(arguments)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .unwrap()
}

fn is_here() -> bool {
    match Denoiser::open(0) {
        Ok(_) => true,
        Err(DenoiseError::Missing(_)) => false,
        Err(error) => panic!("{error}"),
    }
}

/// Mean of (a − b)²/(b² + 0.01).
fn rel_mse(a: &Image, b: &Image) -> f64 {
    let pairs = a.color.iter().flatten().zip(b.color.iter().flatten());
    let errors = pairs.map(|(&a, &b)| f64::from((a - b).powi(2) / (b * b + 0.01)));
    errors.sum::<f64>() / (3 * a.color.len()) as f64
}

#[test]
fn noise_goes_and_the_picture_stays() {
    let folder = folder("denoise");
    let [noisy, plain, reference] =
        ["noisy", "plain", "reference"].map(|name| folder.join(name).with_extension("exr"));
    let output = render(&noisy, &["--spp", "4", "--denoise"]);
    let said = String::from_utf8_lossy(&output.stderr);
    if !is_here() {
        assert!(!output.status.success());
        assert!(said.contains("./setup.sh --with-denoiser"), "{said}");
        assert!(!noisy.exists(), "it is told before anything is rendered");
        return;
    }
    assert!(output.status.success(), "{said}");
    let clean = folder.join("noisy.denoised.exr");
    let printed = String::from_utf8_lossy(&output.stdout);
    assert!(printed.contains("noisy.denoised.exr"), "{printed}");
    assert!(render(&plain, &["--spp", "4"]).status.success());
    let many = ["--spp", "256", "--seed", "7"];
    assert!(render(&reference, &many).status.success());

    let [noisy, plain, reference, clean] =
        [noisy, plain, reference, clean].map(|path| read_exr(&path).unwrap());
    assert_eq!(noisy.color, plain.color, "the noisy image is what it was");
    let layer = noisy.layer("denoised").and_then(|layer| layer.rgb());
    assert_eq!(layer.as_ref(), Some(&clean.color));
    let (before, after) = (rel_mse(&noisy, &reference), rel_mse(&clean, &reference));
    assert!(after < 0.25 * before, "relMSE {before} became {after}");
    let mean = |image: &Image| image.color.iter().flatten().sum::<f32>();
    let change = mean(&clean) / mean(&noisy) - 1.0;
    assert!(change.abs() < 0.01, "the mean changed by {change}");
}

#[test]
fn a_folder_without_the_library_is_named() {
    let output = Command::new(env!("CARGO_BIN_EXE_smithwalk"))
        .args(["render", SCENE, "--spp", "1", "--denoise", "-o"])
        .arg(folder("denoise-nowhere").join("a.exr"))
        .env("OIDN_DIR", "/nonexistent")
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success());
    assert!(said.contains("OIDN_DIR is `/nonexistent`"), "{said}");
}

#[test]
fn guides_of_another_size_are_refused() {
    if !is_here() {
        return;
    }
    let denoiser = Denoiser::open(1).unwrap();
    let (four, one) = ([[0.5; 3]; 4], [[0.5; 3]; 1]);
    let guides = Guides {
        albedo: &four,
        normal: &one,
    };
    let refused = denoiser.denoise(&four, [2, 2], guides);
    assert!(
        matches!(
            refused,
            Err(DenoiseError::Size {
                name: "normal",
                found: 1,
                ..
            })
        ),
        "{refused:?}"
    );
}
