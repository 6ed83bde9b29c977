//! `smithwalk diff` as users run it. The Blender files in `tests/data` show the
//! start-up cube under a blue world, 16 × 12 pixels, rendered by Blender 3.4.1
//! with 4 samples per pixel and saved in three ways.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;
use smithwalk::image::{Display, Image, Layer, OutputPath, Window, read_exr};

const FLOAT: &str = "tests/data/blender-float.exr";
const HALF: &str = "tests/data/blender-half.exr";
const MULTILAYER: &str = "tests/data/blender-multilayer.exr";

/// The first pixel, and the one at column 8, row 6, of the float file.
const TOP_LEFT: [f32; 3] = [0.1, 0.3, 0.8];
const CENTRE: [f32; 3] = [0.303_560_4, 0.465_018_42, 0.868_663_43];

fn diff(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_smithwalk"));
    command.arg("diff").args(arguments).output().unwrap()
}

fn code(output: &Output) -> i32 {
    output.status.code().expect("no signal")
}

fn json(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).expect("JSON on standard output")
}

fn temporary(name: &str) -> PathBuf {
    let name = format!("smithwalk-diff-{}-{name}", std::process::id());
    std::env::temp_dir().join(name)
}

/// Writes a picture, removed at the end.
struct File(PathBuf);

impl File {
    fn new(name: &str, image: &Image) -> Self {
        let path = temporary(name);
        OutputPath::new(&path)
            .unwrap()
            .write(image, &Display::default())
            .unwrap();
        Self(path)
    }

    fn name(&self) -> &str {
        self.0.to_str().unwrap()
    }
}

impl Drop for File {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

fn grey(value: f32) -> Image {
    let mut image = Image::black([16, 16], Window::full([16, 16]));
    image.color.fill([value; 3]);
    image
}

/// Values that Blender itself gave for pixels of its file.
#[test]
fn blender_files_are_read() {
    let image = read_exr(Path::new(FLOAT)).unwrap();
    assert_eq!(image.resolution, [16, 12]);
    let close = |found: [f32; 3], expected: [f32; 3], tolerance: f32| {
        let pairs = found.iter().zip(expected);
        let worst = pairs.map(|(a, b)| (a - b).abs() / b).fold(0.0, f32::max);
        assert!(worst <= tolerance, "{found:?}, not {expected:?}");
    };
    close(image.color[0], TOP_LEFT, 0.0);
    close(image.color[6 * 16 + 8], CENTRE, 0.0);
    let half = read_exr(Path::new(HALF)).unwrap();
    close(half.color[6 * 16 + 8], CENTRE, 1.0 / 1024.0);
    let multilayer = read_exr(Path::new(MULTILAYER)).unwrap();
    // DWAA is lossy.
    close(multilayer.color[6 * 16 + 8], CENTRE, 0.02);
    let depth = multilayer.layer("ViewLayer.Depth").unwrap();
    assert_eq!(depth.channels, ["Z"]);
}

#[test]
fn a_bound_decides_the_exit_code() {
    let same = diff(&[FLOAT, FLOAT, "--max-rel-bias", "0", "--max-relmse", "0"]);
    assert_eq!(code(&same), 0);
    let half = |bound| diff(&[HALF, FLOAT, "--max-relmse", bound]);
    assert_eq!(code(&half("1e-6")), 0);
    let failed = half("1e-12");
    assert_eq!(code(&failed), 1);
    let text = String::from_utf8(failed.stdout).unwrap();
    assert!(text.contains("FAILED: relMSE"), "{text}");
    assert_eq!(code(&diff(&[MULTILAYER, FLOAT])), 0, "no bound, no failure");
}

#[test]
fn json_has_the_figures() {
    let (a, b) = (
        File::new("json-a.exr", &grey(1.1)),
        File::new("json-b.exr", &grey(1.0)),
    );
    let output = diff(&[a.name(), b.name(), "--json", "--max-rel-bias", "0.05"]);
    assert_eq!(code(&output), 1);
    let figures = json(&output);
    let number = |field: &str| figures[field].as_f64().unwrap_or_else(|| panic!("{field}"));
    let close = |field: &str, expected: f64| {
        let found = number(field);
        assert!((found - expected).abs() < 1e-6, "{field}: {found}");
    };
    close("width", 16.0);
    close("height", 16.0);
    close("rel_bias", 0.1);
    close("rel_bias_trimmed", 0.1);
    close("mse", 0.01);
    close("rmse", 0.1);
    close("rel_mse", 0.01 / 1.01);
    close("rel_mse_trimmed", 0.01 / 1.01);
    // The median over the value that 1.4826 of them make a standard deviation of.
    close("robust_sd", 1.482_602_2 * 0.1 / 1.01_f64.sqrt());
    close("largest_deviation", 1.0 / 1.482_602_2);
    close("outliers", 0.0);
    assert!(number("flip") >= 0.0);
    assert!((figures["mean_a"][2].as_f64().unwrap() - 1.1).abs() < 1e-6);
    assert!((figures["mean_b"][0].as_f64().unwrap() - 1.0).abs() < 1e-6);
    assert_eq!(figures["failures"].as_array().unwrap().len(), 1);
    assert!(figures.get("z_max").is_none(), "z was not asked for");
}

#[test]
fn z_tests_count_as_bounds() {
    let with_variance = |value: f32, variance: f32| {
        let mut image = grey(value);
        let mut layer = Layer::black("variance", &["R", "G", "B"], 256);
        layer
            .planes
            .iter_mut()
            .for_each(|plane| plane.fill(variance));
        image.layers.push(layer);
        image
    };
    let b = File::new("z-b.exr", &grey(1.0));
    // Half a σ in every pixel: 4 σ per block of 64, 8 σ in the whole image.
    let faint = File::new("z-faint.exr", &with_variance(1.1, 0.04));
    let output = diff(&[faint.name(), b.name(), "--z", "--json"]);
    assert_eq!(code(&output), 1);
    let figures = json(&output);
    assert_eq!(figures["z_failed_pixels"], 0);
    assert_eq!(figures["z_failed_blocks"], 4);
    assert!((figures["z_mean"][1].as_f64().unwrap() - 8.0).abs() < 1e-2);

    let far_less = File::new("z-less.exr", &with_variance(1.01, 0.04));
    assert_eq!(code(&diff(&[far_less.name(), b.name(), "--z"])), 0);
    let without = diff(&[b.name(), b.name(), "--z"]);
    assert_eq!(code(&without), 2);
    let text = String::from_utf8(without.stderr).unwrap();
    assert!(text.contains("variance"), "{text}");
}

#[test]
fn a_map_is_written() {
    let (mut bright, dark) = (grey(1.0), grey(1.0));
    bright.color[17] = [3.0; 3];
    let (a, b) = (
        File::new("map-a.exr", &bright),
        File::new("map-b.exr", &dark),
    );
    let map = temporary("map.png");
    let output = diff(&[a.name(), b.name(), "--out", map.to_str().unwrap()]);
    assert_eq!(code(&output), 0);
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("red where A is brighter"), "{text}");
    let bytes = std::fs::read(&map).unwrap();
    std::fs::remove_file(&map).unwrap();
    let png = image::load_from_memory(&bytes).unwrap().into_rgb8();
    assert_eq!(png.dimensions(), (16, 16));
    let [red, _, blue] = png.get_pixel(1, 1).0;
    assert!(red > 150 && blue < 60);
    assert_eq!(png.get_pixel(0, 0).0, [247; 3]);
    assert_eq!(code(&diff(&[a.name(), b.name(), "--out", "map.gif"])), 2);
    assert_eq!(
        code(&diff(&[a.name(), b.name(), "--out", "Cargo.toml/map.png"])),
        2
    );
}

#[test]
fn what_can_not_be_compared_exits_with_2() {
    let error = |arguments: &[&str]| {
        let output = diff(arguments);
        assert_eq!(code(&output), 2, "{arguments:?}");
        assert!(output.stdout.is_empty());
        String::from_utf8(output.stderr).unwrap()
    };
    assert!(error(&["missing.exr", FLOAT]).contains("missing.exr"));
    assert!(error(&[FLOAT, "Cargo.toml"]).contains("no OpenEXR file"));
    assert!(error(&[FLOAT]).contains("Usage"));
    assert!(error(&[FLOAT, FLOAT, "--max-relmse", "-1"]).contains("not negative"));
    let small = File::new("small.exr", &grey(1.0));
    let text = error(&[small.name(), FLOAT]);
    assert!(text.contains("16 × 16 and 16 × 12"), "{text}");
}

#[test]
fn infinite_pixels_fail_whatever_the_bounds() {
    let mut broken = grey(1.0);
    broken.color[9][1] = f32::NAN;
    let a = File::new("nan.exr", &broken);
    let b = File::new("nan-b.exr", &grey(1.0));
    let output = diff(&[a.name(), b.name(), "--json"]);
    assert_eq!(code(&output), 1);
    assert_eq!(json(&output)["non_finite_pixels"], 1);
}

/// One file: both images, their values and the figures; names from files are text alone.
#[test]
fn the_page_holds_all_of_the_comparison() {
    let a = File::new("<b>ours.exr", &grey(0.5));
    let b = File::new("theirs.exr", &grey(0.25));
    let page = temporary("report.html");
    let output = diff(&[a.name(), b.name(), "--html", page.to_str().unwrap()]);
    assert_eq!(code(&output), 0);
    let text = std::fs::read_to_string(&page).unwrap();
    std::fs::remove_file(&page).unwrap();
    assert!(!text.contains("{{") && !text.contains("<b>"));
    assert!(text.contains("100.000 % brighter than"), "the sentence");
    assert_eq!(
        text.matches("data:image/png;base64,").count(),
        3,
        "two images and a map"
    );
    // 0.5 as floats, little end first, three times and a quarter of the fourth.
    assert!(text.contains("AAAAPwAAAD8AAAA/"));
    assert!(!text.contains("http"), "nothing is fetched");
}
