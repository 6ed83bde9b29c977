//! Lights, cameras, the environment, textures and geometry against Cycles 3.4
//! and 4.5, case by case: tiny scenes that `blender/measure_parity.py` built,
//! exported and rendered with both.

use std::path::{Path, PathBuf};

use crate::common::{Settings, image};
use smithwalk::image::{Image, read_exr};

/// Pixels on a side of the blocks that are compared: enough to average noise
/// away, few enough that a mirrored or shifted image stands out.
const BLOCK: usize = 4;

/// Folders with a scene and its reference.
fn cases() -> Vec<PathBuf> {
    let mut found = Vec::new();
    let root = Path::new("tests/data/parity");
    for case in std::fs::read_dir(root).expect("the cases are there") {
        for version in std::fs::read_dir(case.expect("readable").path()).expect("a folder") {
            let folder = version.expect("readable").path();
            if folder.join("scene.yaml").exists() {
                found.push(folder);
            }
        }
    }
    found.sort();
    assert!(found.len() >= 40, "only {} cases", found.len());
    found
}

/// Means over blocks of the three channels.
fn blocks(image: &Image) -> Vec<[f64; 3]> {
    let width = image.window.width as usize;
    let height = image.window.height as usize;
    let mut means = Vec::new();
    for y in (0..height).step_by(BLOCK) {
        for x in (0..width).step_by(BLOCK) {
            let mut sum = [0.0; 3];
            let mut count = 0.0;
            for row in y..(y + BLOCK).min(height) {
                for pixel in &image.color[row * width + x..row * width + (x + BLOCK).min(width)] {
                    count += 1.0;
                    for (sum, &value) in sum.iter_mut().zip(pixel) {
                        *sum += f64::from(value);
                    }
                }
            }
            means.push(sum.map(|sum| sum / count));
        }
    }
    means
}

/// Relative difference of the means, and the root mean square difference of
/// the blocks over the mean.
fn departures(folder: &Path) -> (f64, f64) {
    let ours = image(&folder.join("scene.yaml"), &[], Settings::spp(256), &[]);
    let theirs = read_exr(&folder.join("reference.exr")).expect("the reference reads");
    assert_eq!(ours.resolution, theirs.resolution, "{}", folder.display());
    let (a, b) = (blocks(&ours), blocks(&theirs));
    let n = a.len() as f64 * 3.0;
    let mean: f64 = b.iter().flatten().sum::<f64>() / n;
    let ours_mean: f64 = a.iter().flatten().sum::<f64>() / n;
    let squares: f64 = a
        .iter()
        .flatten()
        .zip(b.iter().flatten())
        .map(|(x, y)| (x - y).powi(2))
        .sum();
    (ours_mean / mean - 1.0, (squares / n).sqrt() / mean)
}

/// Means within 0.3 %, blocks within 2 %: both far above the noise of 256
/// samples in 1024 pixels of such plain scenes, and far below what a wrong
/// unit, axis or convention does.
#[test]
fn conventions_are_those_of_cycles() {
    let mut failures = Vec::new();
    for folder in cases() {
        let (bias, blocks) = departures(&folder);
        let name = folder
            .components()
            .rev()
            .take(2)
            .map(|c| c.as_os_str().to_string_lossy().into_owned())
            .collect::<Vec<_>>();
        let line = format!(
            "{:<28} {:>4}  mean {:+.4} %  blocks {:.4} %",
            name[1],
            name[0],
            100.0 * bias,
            100.0 * blocks
        );
        println!("{line}");
        // Written so that NaN fails.
        if !(bias.abs() < 3e-3 && blocks < 2e-2) {
            failures.push(line);
        }
    }
    assert!(
        failures.is_empty(),
        "{} cases depart:\n{}",
        failures.len(),
        failures.join("\n")
    );
}
