//! The command line as scripts see it: names, fields, exit codes.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

fn smithwalk(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_smithwalk"))
        .args(args)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("the program starts")
}

fn json(args: &[&str]) -> Value {
    let output = smithwalk(args);
    assert!(
        output.status.success(),
        "{args:?}: {}",
        String::from_utf8_lossy(&output.stderr)
    );
    serde_json::from_slice(&output.stdout).expect("JSON on stdout")
}

/// A folder of its own for a test's files, empty at the start.
fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&path);
    std::fs::create_dir_all(&path).expect("a folder for the test");
    path
}

const SCENE: &str = "scenes/gold_sphere/scene.yaml";

fn numbers(value: &Value) -> Vec<f64> {
    value
        .as_array()
        .expect("an array")
        .iter()
        .map(|v| v.as_f64().expect("a number"))
        .collect()
}

/// Gold of Blender roughness 1 against the exact albedo, which an independent
/// walk gave (green .4916 .5566 .6548 at cosθ .999 .5 .1, ± 2e-4); 5 standard
/// errors: false alarm 6e-7 each.
#[test]
fn albedo_has_the_documented_fields_and_the_known_values() {
    let material = "conductor: {roughness: 1, color: [1, 0.71, 0.29]}";
    let rows = json(&[
        "bsdf",
        "albedo",
        "--material",
        material,
        "--cos",
        "0.999,0.5,0.1",
        "--samples",
        "200000",
        "--json",
    ]);
    let rows = rows.as_array().expect("an array of rows");
    for (row, green) in rows.iter().zip([0.4916, 0.5566, 0.6548]) {
        let (r, se) = (numbers(&row["r"]), numbers(&row["r_se"]));
        assert!((r[0] - 1.0).abs() < 1e-5, "red is white: {}", r[0]);
        assert!((r[1] - green).abs() < 5.0 * se[1] + 2e-4, "{row}");
        assert!(
            numbers(&row["t"])
                .iter()
                .chain(&numbers(&row["t_se"]))
                .all(|&t| t == 0.0)
        );
        let orders = numbers(&row["orders"]);
        let mean = r.iter().sum::<f64>() / 3.0;
        assert!((orders.iter().sum::<f64>() - mean).abs() < 1e-6);
        assert!(row["mean_order"].as_f64().expect("a number") > 1.2);
    }
}

/// All estimators agree on a pair of directions; 5σ, false alarm 6e-7 each.
#[test]
fn eval_agrees_between_estimators() {
    for material in [
        "conductor: {alpha: 0.7, color: [1, 0.71, 0.29]}",
        "dielectric: {alpha: 0.5, distribution: beckmann}",
        "rough_diffuse: {alpha_x: 0.3, alpha_y: 0.9}",
    ] {
        let eval = |estimator: &str| {
            let report = json(&[
                "bsdf",
                "eval",
                "--material",
                material,
                "--wo",
                "0.5,0.1,0.8",
                "--wi",
                "-0.6,0.3,0.5",
                "--samples",
                "200000",
                "--estimator",
                estimator,
                "--json",
            ]);
            assert!(report["ns"].as_f64().expect("a time") > 0.0);
            let orders: f64 = report["orders"]
                .as_array()
                .expect("orders")
                .iter()
                .map(|o| numbers(o)[1])
                .sum();
            let value = numbers(&report["value"])[1];
            assert!(
                (orders - value).abs() < 1e-6 * value.max(1.0),
                "orders add up"
            );
            assert_eq!(
                report["orders"].as_array().map(Vec::len),
                report["orders_se"].as_array().map(Vec::len)
            );
            (value, numbers(&report["se"])[1])
        };
        let (walk, walk_se) = eval("walk");
        for estimator in ["two-walk", "position-free", "auto"] {
            let (value, se) = eval(estimator);
            let sigma = walk_se.hypot(se);
            assert!(
                (value - walk).abs() < 5.0 * sigma,
                "{material} {estimator}: {value} against {walk} ± {sigma}"
            );
        }
        let (single, _) = eval("single");
        assert!(single < walk, "single scattering is a part of it");
    }
}

/// White mirrors with quadratic normals have f = (cosθ_o + cosθ_i) / (π (1 + ω_o·ω_i))
/// (Dupuy 2026); 5 standard errors: false alarm 6e-7 each.
#[test]
fn quadratic_mirrors_have_their_closed_form() {
    for (wo, wi) in [
        ([0.6, 0.0, 0.8], [-0.48, 0.64, 0.6]),
        ([0.8, 0.0, 0.6], [0.0, 0.96, 0.28]),
    ] {
        let text = |w: [f64; 3]| w.map(|x| x.to_string()).join(",");
        let report = json(&[
            "bsdf",
            "eval",
            "--material",
            "conductor: {distribution: quadratic}",
            "--wo",
            &text(wo),
            "--wi",
            &text(wi),
            "--json",
        ]);
        let dot: f64 = wo.iter().zip(wi).map(|(a, b)| a * b).sum();
        let exact = wi[2] * (wo[2] + wi[2]) / (std::f64::consts::PI * (1.0 + dot));
        let (value, se) = (numbers(&report["value"])[1], numbers(&report["se"])[1]);
        assert!(se < 0.01 * exact);
        assert!(
            (value - exact).abs() < 5.0 * se + 1e-6 * exact,
            "{value} ± {se} against {exact}"
        );
    }
    let refused = smithwalk(&[
        "bsdf",
        "albedo",
        "--cos",
        "1",
        "--material",
        "conductor: {distribution: quadratic, alpha: 0.5}",
    ]);
    assert_eq!(refused.status.code(), Some(2));
    let message = String::from_utf8_lossy(&refused.stderr);
    assert!(
        message.contains("the quadratic distribution has no roughness"),
        "{message}"
    );
}

#[test]
fn sample_writes_columns_of_one_length() {
    let table = json(&[
        "bsdf",
        "sample",
        "--material",
        "dielectric: {alpha: 0.3}",
        "--wo",
        "0.3,0,0.9",
        "--samples",
        "500",
        "--json",
    ]);
    let columns = ["wi_x", "wi_y", "wi_z", "weight", "order", "pdf"];
    let lengths: Vec<_> = columns
        .map(|name| table[name].as_array().expect(name).len())
        .into_iter()
        .collect();
    assert!(
        lengths.iter().all(|&n| n == lengths[0] && n > 490),
        "{lengths:?}"
    );
    let z = numbers(&table["wi_z"]);
    assert!(
        z.iter().any(|&z| z > 0.0) && z.iter().any(|&z| z < 0.0),
        "both sides"
    );
}

#[test]
fn render_writes_what_it_says_and_diff_agrees() {
    let folder = folder("render");
    let exr = folder.join("a.exr");
    let png = folder.join("a.png");
    let (exr_name, png_name) = (exr.to_str().expect("UTF-8"), png.to_str().expect("UTF-8"));
    let size = ["-D", "film.width=48", "-D", "film.height=48"];
    let common = [
        "render", SCENE, "--spp", "4", "-o", exr_name, "-o", png_name,
    ];
    let output = smithwalk(&[&common[..], &size[..]].concat());
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    assert!(
        text.contains(exr_name) && text.contains(png_name) && text.contains("Mrays/s"),
        "{text}"
    );
    assert!(text.contains("left out: textures"), "{text}");
    assert!(exr.exists() && png.exists());

    let same = smithwalk(&["diff", exr_name, exr_name, "--json", "--max-relmse", "0"]);
    assert_eq!(same.status.code(), Some(0));
    let other = folder.join("b.exr");
    let other_name = other.to_str().expect("UTF-8");
    let args = [
        "render", SCENE, "--spp", "4", "--seed", "9", "-o", other_name,
    ];
    assert!(smithwalk(&[&args[..], &size[..]].concat()).status.success());
    let bound = smithwalk(&["diff", exr_name, other_name, "--max-relmse", "1e-9"]);
    assert_eq!(bound.status.code(), Some(1), "past a bound");
}

/// An interrupted and resumed render has the bits of one that ran through.
#[test]
fn resume_goes_on_where_it_stopped() {
    let folder = folder("resume");
    let (parts, whole) = (folder.join("parts.exr"), folder.join("whole.exr"));
    let (parts, whole) = (
        parts.to_str().expect("UTF-8"),
        whole.to_str().expect("UTF-8"),
    );
    let size = ["-D", "film.width=40", "-D", "film.height=40"];
    let runs = [
        ("3", parts, ""),
        ("5", parts, "resuming at 3 samples"),
        ("12", parts, "resuming at 5 samples"),
        ("12", whole, ""),
    ];
    for (spp, file, said) in runs {
        let args = ["render", SCENE, "--resume", "--spp", spp, "-o", file];
        let output = smithwalk(&[&args[..], &size[..]].concat());
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        let log = String::from_utf8_lossy(&output.stderr);
        assert!(log.contains(said), "{spp}: {log}");
    }
    let figures = json(&["diff", parts, whole, "--json"]);
    assert_eq!(figures["mse"].as_f64(), Some(0.0));
}

#[test]
fn info_names_what_is_in_and_what_is_left_out() {
    let report = json(&["info", SCENE, "--json"]);
    let used = |name: &str| {
        let features = report["features"].as_array().expect("features");
        let feature = features.iter().find(|f| f["name"] == name).expect(name);
        (
            feature["used"].as_bool().expect("bool"),
            feature["in_kernel"].as_bool().expect("bool"),
        )
    };
    assert_eq!(used("multiple scattering"), (true, true));
    assert_eq!(used("area lights"), (true, true));
    assert_eq!(used("textures"), (false, false));
    let text = smithwalk(&["info", SCENE]);
    assert!(String::from_utf8_lossy(&text.stdout).contains("left out:"));
}

/// Bad input ends with exit code 2 and a message, before any rendering.
#[test]
fn bad_input_is_told_and_never_panics() {
    let folder = folder("bad");
    let scene = folder.join("bad.yaml");
    std::fs::write(
        &scene,
        "smithwalk: 1\ncamera: {projection: {perspectiv: {fov: 30}}}\nfilm: {widht: 3}\n",
    )
    .expect("writes");
    let scene = scene.to_str().expect("UTF-8");
    let cases: &[(&[&str], &[&str])] = &[
        (
            &["render", scene],
            &["perspectiv", "widht", "width", "bad.yaml:2", "bad.yaml:3"],
        ),
        (&["render", "nowhere.yaml"], &["nowhere.yaml"]),
        (
            &["render", SCENE, "-o", "/proc/nothing/x.exr"],
            &["/proc/nothing"],
        ),
        (&["render", SCENE, "-o", "x.jpg"], &["jpg"]),
        (&["render", SCENE, "--crop", "0,0,9999,10"], &["9999"]),
        (
            &["render", SCENE, "-D", "film.widht=3"],
            &["widht", "width"],
        ),
        (
            &[
                "bsdf",
                "albedo",
                "--material",
                "conductr: {}",
                "--cos",
                "0.5",
            ],
            &["conductr", "conductor"],
        ),
        (
            &[
                "bsdf",
                "eval",
                "--material",
                "conductor: {alpha: 0}",
                "--wo",
                "0,0,1",
                "--wi",
                "0,0,1",
            ],
            &["single directions"],
        ),
        (&["diff", "Cargo.toml", "Cargo.toml"], &["Cargo.toml"]),
    ];
    for (args, expected) in cases {
        let output = smithwalk(args);
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{args:?}: {text}");
        assert!(!text.contains("panicked"), "{args:?}: {text}");
        for word in *expected {
            assert!(text.contains(word), "{args:?} should name `{word}`: {text}");
        }
    }
}

/// White materials give back all light, through tables and through the
/// renderer, also where normals are smooth; the command's own bound is 5σ, for 492
/// means: false alarm below 3e-4. Mirrors have no noise.
#[test]
fn the_furnace_is_white() {
    let report = json(&["furnace", "--json", "--samples", "60000", "--spp", "48"]);
    assert_eq!(report["passed"].as_bool(), Some(true));
    assert_eq!(report["table"].as_array().map(Vec::len), Some(144));
    let rendered = report["rendered"].as_array().expect("rows");
    assert_eq!(rendered.len(), 204);
    for row in rendered {
        if row["material"] == "conductor" && row["alpha_x"] == 0.0 {
            let least = row["least"].as_f64().expect("a number");
            assert!(least > 1.0 - 1e-6, "{row}");
        }
    }
}
