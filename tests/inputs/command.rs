//! The command with arguments and scenes that are too large, or none.

use super::{assert_none, directory};
use smithwalk::description::Description;
use std::path::Path;
use std::process::{Command, Output};

fn run(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_smithwalk"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("the command is built")
}

const SCENE: &str = "smithwalk: 1
camera: {transform: {location: [0, 0, 5]}, projection: {perspective: {fov: 40}}}
film: {width: 8, height: 8}
sampling: {spp: 1, branches: 1}
world: {constant: {}}
materials: {m: {diffuse: {}}}
meshes: {t: {file: t.obj}}
objects: [{mesh: t, material: m}]
";

fn scene(name: &str) -> std::path::PathBuf {
    let folder = directory(name);
    std::fs::write(folder.join("s.yaml"), SCENE).unwrap();
    std::fs::write(folder.join("t.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    std::fs::write(folder.join("x.blend"), b"BLENDER-v304RENDH").unwrap();
    folder
}

#[test]
fn too_much_is_refused_in_a_sentence() {
    let folder = scene("refused");
    let deep = format!("{}=1", vec!["a"; 60_000].join("."));
    let mut faults = Vec::new();
    for (arguments, said) in [
        (
            &["render", "s.yaml", "--time", "1e20"][..],
            "expected a time below a thousand years",
        ),
        (
            &["render", "s.yaml", "--threads", "5000"],
            "5000 is not in 1..=1024",
        ),
        (
            &["render", "s.yaml", "--memory", "much"],
            "expected a number of bytes, e.g. 8e9",
        ),
        (
            &["render", "s.yaml", "--memory", "1e3"],
            "a film of 8 × 8 pixels needs 10.1 kB, but 1.0 kB of 1.0 kB are left; --memory sets the limit",
        ),
        (&["info", "s.yaml", "--memory", "11e3"], "more than the"),
        (
            &[
                "render",
                "s.yaml",
                "-D",
                "film.width=32768",
                "-D",
                "film.height=32768",
                "--memory",
                "8e9",
            ],
            "a film of 32768 × 32768 pixels needs 169.7 GB",
        ),
        (
            &["render", "."],
            ".: the scene can't be read: expected a file, found a folder",
        ),
        (
            &["render", "x.blend"],
            "expected a scene in YAML, found a Blender file: blender/export.py makes a scene of it",
        ),
        (
            &["render", "none.yaml"],
            "none.yaml: the scene can't be read: No such file",
        ),
        (
            &["render", "s.yaml", "-D", &deep],
            "expected at most 64 keys joined by dots",
        ),
        (
            &[
                "bsdf",
                "albedo",
                "--material",
                "\u{1b}[31m",
                "--cos",
                "1",
                "--samples",
                "100",
                "--json",
            ],
            "material",
        ),
    ] {
        let output = run(&folder, arguments);
        let error = String::from_utf8_lossy(&output.stderr);
        let control = error.contains(|c: char| c.is_control() && c != '\n');
        if output.status.code() != Some(2) || !error.contains(said) || control || error.len() > 4000
        {
            faults.push(format!("{said}: {} {error}", output.status));
        }
    }
    assert_none(&faults);
}

#[test]
fn a_hundred_thousand_keys_take_no_time() {
    use std::fmt::Write;
    let mut many = "materials:\n  m: {diffuse: {}}\n".to_owned();
    for i in 0..100_000 {
        writeln!(many, "  m{i}: {{diffuse: {{color: .5}}}}").unwrap();
    }
    let text = SCENE.replace("materials: {m: {diffuse: {}}}\n", &many);
    // Of this thread alone: the machine may have other work.
    let start = cpu_time::ThreadTime::now();
    let description = Description::from_str(&text, "s.yaml", &[]).unwrap();
    let seconds = start.elapsed().as_secs_f64();
    assert_eq!(description.materials.len(), 100_001);
    // Half a second; the square of the keys took twenty.
    assert!(seconds < 6.0, "{seconds} s");
}

/// Over scenes whose memory is of different kinds.
#[cfg(target_os = "linux")]
#[test]
#[ignore = "depends on what else the machine does: cargo test --test suite -- --ignored info_says_how_much"]
fn info_says_how_much_memory_a_render_takes() {
    let folder = scene("memory");
    for size in ["8", "1200"] {
        let [width, height] = ["width", "height"].map(|side| format!("film.{side}={size}"));
        let changes = ["-D", &width, "-D", &height];
        let output = run(
            &folder,
            &[&["info", "s.yaml", "--json"], &changes[..]].concat(),
        );
        let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        let said = report["memory"].as_u64().expect("Linux tells") as f64;
        let mut render = Command::new(env!("CARGO_BIN_EXE_smithwalk"))
            .args([&["render", "s.yaml", "-o", "o.exr"], &changes[..]].concat())
            .current_dir(&folder)
            .stdout(std::process::Stdio::null())
            .spawn()
            .unwrap();
        let mut peak = 0.0f64;
        let status = format!("/proc/{}/status", render.id());
        while render.try_wait().unwrap().is_none() {
            let text = std::fs::read_to_string(&status).unwrap_or_default();
            let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
            let kib =
                line.and_then(|line| line.split_ascii_whitespace().next()?.parse::<f64>().ok());
            peak = peak.max(kib.unwrap_or(0.0) * 1024.0);
            std::thread::sleep(std::time::Duration::from_millis(2));
        }
        let ratio = said / peak;
        assert!(
            (0.9..1.1).contains(&ratio),
            "{size}: said {said}, took {peak}"
        );
    }
}
