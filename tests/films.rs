//! Films between runs and machines, through the command: what `--resume` takes up and
//! what it refuses, kills and signals at any moment, parts and crops.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::Duration;

use smithwalk::image::{Image, read_exr};
use smithwalk::metrics::mean;

fn command(args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_smithwalk"));
    command.args(args);
    command
}

pub fn succeeds(args: &[&str]) -> Output {
    let output = command(args).output().expect("the program starts");
    let log = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{args:?}: {log}");
    output
}

/// A scene of its own in a folder of its own: a metal with a texture on a mesh under a
/// lamp and an image of the surroundings.
pub struct Room(pub PathBuf);

impl Room {
    pub fn new(name: &str) -> Self {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("films-{name}"));
        let _ = std::fs::remove_dir_all(&folder);
        std::fs::create_dir_all(&folder).unwrap();
        let room = Self(folder);
        room.write("scene.yaml", SCENE);
        room.mesh(1.0);
        room.texture(200);
        room.world(0.5);
        room
    }

    pub fn file(&self, name: &str) -> String {
        self.0.join(name).to_str().expect("UTF-8").to_owned()
    }

    pub fn write(&self, name: &str, text: &str) {
        std::fs::write(self.file(name), text).unwrap();
    }

    /// A tilted square of this size.
    fn mesh(&self, size: f32) {
        let corner = |x: f32, y: f32| format!("v {} {} {}\n", x * size, y * size, 0.3 * x);
        let corners = [
            corner(-1.0, -1.0),
            corner(1.0, -1.0),
            corner(1.0, 1.0),
            corner(-1.0, 1.0),
        ];
        let uvs = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";
        self.write(
            "a.obj",
            &format!("{}{uvs}f 1/1 2/2 3/3 4/4\n", corners.concat()),
        );
    }

    fn texture(&self, grey: u8) {
        let mut image = image::GrayImage::from_pixel(4, 4, image::Luma([grey]));
        image.put_pixel(1, 1, image::Luma([30]));
        image.save(self.file("t.png")).unwrap();
    }

    fn world(&self, radiance: f32) {
        let pixel = image::Rgb([radiance, 0.4, 0.3]);
        image::Rgb32FImage::from_pixel(8, 4, pixel)
            .save(self.file("w.hdr"))
            .unwrap();
    }

    pub fn image(&self, name: &str) -> Image {
        read_exr(Path::new(&self.file(name))).unwrap()
    }

    /// `render` of the scene with these further arguments.
    fn arguments(&self, more: &[&str]) -> Vec<String> {
        let mut all = vec!["render".to_owned(), self.file("scene.yaml")];
        all.extend(more.iter().map(|&argument| argument.to_owned()));
        all
    }

    pub fn command(&self, more: &[&str]) -> Command {
        let arguments = self.arguments(more);
        let mut command = command(&arguments.iter().map(String::as_str).collect::<Vec<_>>());
        command.current_dir(&self.0);
        command
    }

    pub fn render(&self, more: &[&str]) -> Output {
        let output = self.command(more).output().expect("the program starts");
        let log = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{more:?}: {log}");
        output
    }

    /// What `--resume` says to the film of `a.exr`; whether it goes on.
    fn resume(&self, more: &[&str]) -> (bool, String) {
        let common = ["-o", "a.exr", "--resume", "--spp", "4"];
        let output = self
            .command(&[&common[..], more].concat())
            .output()
            .unwrap();
        let log = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!log.contains("panicked"), "{log}");
        (
            output.status.success() && log.contains("resuming at 2"),
            log,
        )
    }
}

impl Drop for Room {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

const SCENE: &str = "smithwalk: 1
camera: {projection: {perspective: {fov: 40}}, transform: {look_at: {from: [0, -3, 2], to: [0, 0, 0]}}}
film: {width: 32, height: 24, exposure: 0}
sampling: {spp: 8}
world: {environment: {file: w.hdr}}
lights: [{area: {shape: {rectangle: {width: 0.3, height: 0.3}}, power: 20, transform: {look_at: {from: [1, -1, 2], to: [0, 0, 0]}}}}]
textures: {t: {file: t.png, color_space: srgb}}
materials: {m: {rough_diffuse: {alpha: 0.5, color: {texture: t}}}}
meshes: {a: {file: a.obj}}
objects: [{name: square, mesh: a, material: m}]
";

/// Each row of the table in `docs/films.md`: what is changed, and by what name the
/// change is refused, if it is.
#[test]
fn resume_refuses_what_changes_samples_and_nothing_else() {
    type Change = fn(&Room);
    let replace = |room: &Room, from: &str, to: &str| {
        assert!(SCENE.contains(from));
        room.write("scene.yaml", &SCENE.replace(from, to));
    };
    let room = Room::new("table");
    let corners = "0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 0 1\n1 0 1\n0 1 1\n1 1 1\n";
    room.write("view.cube", &format!("LUT_3D_SIZE 2\n{corners}"));
    room.render(&["-o", "a.exr", "--resume", "--spp", "2"]);
    let film = std::fs::read(room.file("a.exr.film")).unwrap();
    let restore = || {
        room.write("scene.yaml", SCENE);
        room.mesh(1.0);
        room.texture(200);
        room.world(0.5);
        std::fs::write(room.file("a.exr.film"), &film).unwrap();
    };

    let goes_on: [(&str, &[&str], [&str; 2]); 6] = [
        ("nothing", &[], ["", ""]),
        ("more threads", &["--threads", "3"], ["", ""]),
        ("another exposure", &["-D", "film.exposure=2"], ["", ""]),
        (
            "another view",
            &[
                "-D",
                "film.view={lut: view.cube, log2: {offset: 1, min: 0, max: 4}}",
            ],
            ["", ""],
        ),
        ("another object name", &[], ["name: square", "name: circle"]),
        ("another scene spp", &[], ["spp: 8", "spp: 80"]),
    ];
    for (what, arguments, [from, to]) in goes_on {
        restore();
        replace(&room, from, to);
        let (goes_on, log) = room.resume(arguments);
        assert!(goes_on, "{what}: {log}");
    }
    // The same files by other names.
    restore();
    let scene = room.0.file_name().unwrap().to_str().unwrap();
    let from_above = command(&[
        "render",
        &format!("./{scene}/../{scene}/scene.yaml"),
        "-o",
        &room.file("a.exr"),
        "--resume",
        "--spp",
        "4",
    ])
    .current_dir(room.0.parent().unwrap())
    .output()
    .unwrap();
    let log = String::from_utf8_lossy(&from_above.stderr);
    assert!(log.contains("resuming at 2"), "{log}");

    let files: [(&str, Change); 3] = [
        ("another mesh `a`", |room| room.mesh(1.1)),
        ("another texture `t`", |room| room.texture(190)),
        ("another world", |room| room.world(0.6)),
    ];
    for (named, change) in files {
        restore();
        change(&room);
        let (goes_on, log) = room.resume(&[]);
        assert!(!goes_on && log.contains(named), "{named}: {log}");
    }
    let values: [(&str, [&str; 2]); 4] = [
        ("another material `m`", ["alpha: 0.5", "alpha: 0.6"]),
        ("another camera", ["fov: 40", "fov: 41"]),
        ("another light 0", ["power: 20", "power: 21"]),
        (
            "another object 0",
            ["material: m", "material: m, visible_to_camera: false"],
        ),
    ];
    for (named, [from, to]) in values {
        restore();
        replace(&room, from, to);
        let (goes_on, log) = room.resume(&[]);
        assert!(!goes_on && log.contains(named), "{named}: {log}");
    }
    let arguments: [(&str, &[&str]); 6] = [
        ("seed 0, not 7", &["--seed", "7"]),
        ("estimator Auto, not Walk", &["--estimator", "walk"]),
        ("max_bounces 12, not 3", &["-D", "sampling.max_bounces=3"]),
        ("another resolution or crop", &["--crop", "0,0,8,8"]),
        ("other AOVs", &["-D", "film.aovs=[depth]"]),
        ("can't be gone on with", &["--part", "1/2"]),
    ];
    for (named, arguments) in arguments {
        restore();
        let (goes_on, log) = room.resume(arguments);
        assert!(!goes_on && log.contains(named), "{named}: {log}");
    }
    // A film of another version of the format, and one of another program.
    restore();
    let mut other = film.clone();
    other[15] += 1;
    std::fs::write(room.file("a.exr.film"), &other).unwrap();
    let (goes_on, log) = room.resume(&[]);
    assert!(!goes_on && log.contains("another version"), "{log}");
}

/// SIGTERM loses nothing: image and film are there, and the rest follows with the same
/// bits. A later complete run takes the film of the interrupted one away.
#[test]
fn a_terminated_render_is_saved_and_goes_on() {
    let room = Room::new("term");
    let mut child = room.command(&["-o", "a.exr", "--spp", "1000000"]);
    let mut child = child
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(Duration::from_millis(700));
    let id = child.id().to_string();
    assert!(
        Command::new("kill")
            .args(["-TERM", &id])
            .status()
            .unwrap()
            .success()
    );
    let code = child.wait().unwrap().code();
    // Where the machine is so slow that it had not begun, the signal has its own way.
    if code.is_some() {
        assert_eq!(code, Some(143));
        assert!(Path::new(&room.file("a.exr")).exists());
        let done = json(&["film", &room.file("a.exr.film"), "--json"]);
        // Tiles may be ahead of the count by a pass, of 64 samples at most.
        let spp = done["spp"].as_u64().unwrap().max(1) + 64;
        let spp = spp.to_string();
        let output = room.render(&["-o", "a.exr", "--resume", "--spp", &spp]);
        assert!(String::from_utf8_lossy(&output.stderr).contains("resuming"));
        room.render(&["-o", "whole.exr", "--spp", &spp]);
        assert_eq!(room.image("a.exr").color, room.image("whole.exr").color);
        assert!(Path::new(&room.file("a.exr.film")).exists());
    }
    room.render(&["-o", "a.exr", "--spp", "2"]);
    assert!(!Path::new(&room.file("a.exr.film")).exists());
}

pub fn json(args: &[&str]) -> serde_json::Value {
    serde_json::from_slice(&succeeds(args).stdout).expect("JSON on stdout")
}

/// Eight parts, merged in any order with any number of threads, have the bits of the
/// whole; some of them have its expectation. The image's mean over three parts of it
/// is normal with the standard error that the variances say: 5 σ, false alarm 6e-7 each.
#[test]
fn parts_add_up_to_the_whole() {
    let room = Room::new("parts");
    let aovs = ["-D", "film.aovs=[variance, depth]"];
    room.render(&[&["-o", "whole.exr", "--spp", "20"][..], &aovs].concat());
    let name = |part: u32| room.file(&format!("p{part}.film"));
    for part in 0..8 {
        let (share, film) = (format!("{part}/8"), name(part));
        let threads = (1 + part % 3).to_string();
        let more = [
            "--part",
            &share,
            "-o",
            &film,
            "--spp",
            "20",
            "--threads",
            &threads,
        ];
        room.render(&[&more[..], &aovs].concat());
    }
    let merge = |parts: &[u32], to: &str| {
        let parts: Vec<String> = parts.iter().map(|&part| name(part)).collect();
        let mut arguments = vec!["merge"];
        arguments.extend(parts.iter().map(String::as_str));
        let to = room.file(to);
        arguments.extend(["-o", &to]);
        command(&arguments).output().unwrap()
    };
    let whole = room.image("whole.exr");
    for order in [[0, 1, 2, 3, 4, 5, 6, 7], [5, 2, 7, 0, 6, 1, 4, 3]] {
        assert!(merge(&order, "merged.exr").status.success());
        let merged = room.image("merged.exr");
        assert_eq!(merged.color, whole.color, "{order:?}");
        assert_eq!(merged.layers, whole.layers, "{order:?}");
    }
    for subset in [[0, 3, 4], [1, 2, 6], [5, 6, 7]] {
        let output = merge(&subset, "some.exr");
        let log = String::from_utf8_lossy(&output.stderr);
        assert!(log.contains("of 20 samples per pixel"), "{log}");
        let some = room.image("some.exr");
        let variance = some.layer("variance").unwrap().rgb().unwrap();
        let pixels = variance.len() as f64;
        for channel in 0..3 {
            let off = mean(&some.color)[channel] - mean(&whole.color)[channel];
            let sigma = (mean(&variance)[channel] / pixels).sqrt();
            assert!(off.abs() < 5.0 * sigma, "{subset:?}: {off} beside {sigma}");
        }
    }
    // Overlaps, and parts of something else, are refused by name.
    let twice = merge(&[1, 2, 1], "some.exr");
    let log = String::from_utf8_lossy(&twice.stderr);
    assert!(
        !twice.status.success() && log.contains("given twice"),
        "{log}"
    );
    let film = name(3);
    let other = ["--part", "3/8", "-o", &film, "--spp", "20", "--seed", "5"];
    room.render(&[&other[..], &aovs].concat());
    let mixed = merge(&[1, 2, 3], "some.exr");
    let log = String::from_utf8_lossy(&mixed.stderr);
    assert!(
        !mixed.status.success() && log.contains("seed 5, not 0"),
        "{log}"
    );
}

/// Crops joined are the whole image, bit for bit.
#[test]
fn crops_join_to_the_whole() {
    let room = Room::new("crops");
    room.render(&["-o", "whole.exr", "--spp", "4"]);
    let whole = room.image("whole.exr");
    for crop in ["0,0,13,24", "13,0,32,11", "13,11,32,24"] {
        room.render(&["-o", "crop.exr", "--spp", "4", "--crop", crop]);
        let part = room.image("crop.exr");
        assert_eq!(part.color, whole.crop(part.window).color, "{crop}");
    }
}

/// Files come first: nobody has to read what is printed.
#[test]
fn a_closed_output_loses_no_file() {
    let room = Room::new("closed");
    let mut child = room.command(&["-o", "a.exr", "-o", "a.png", "--resume", "--spp", "2"]);
    let mut child = child
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop((child.stdout.take(), child.stderr.take()));
    assert!(child.wait().unwrap().success());
    for name in ["a.exr", "a.png", "a.exr.film"] {
        assert!(Path::new(&room.file(name)).exists(), "{name}");
    }
}

#[test]
fn progress_is_one_object_a_line() {
    let room = Room::new("progress");
    let output = room.render(&["-o", "a.exr", "--spp", "40", "--progress", "json"]);
    let log = String::from_utf8_lossy(&output.stderr);
    let lines: Vec<serde_json::Value> = log
        .lines()
        .map(|line| serde_json::from_str(line).expect(line))
        .collect();
    let last = lines.last().expect("there is progress");
    assert_eq!(
        (last["spp"].as_f64(), last["target"].as_u64()),
        (Some(40.0), Some(40))
    );
    for field in ["spp", "target", "elapsed", "eta", "noise", "checkpoint"] {
        assert!(last.get(field).is_some(), "{field}");
    }
}

/// A film that is gone on with is there beside the pilots: with the memory that a fresh
/// render has to have, it is refused before anything is rendered.
#[test]
fn memory_for_a_film_to_go_on_from_is_asked_for() {
    let room = Room::new("memory");
    let [scene, film] = ["scene.yaml", "a.film"].map(|name| room.file(name));
    let render = |spp: &str, more: &[&str]| {
        let mut args = vec!["render", &scene, "--spp", spp, "-o", &film];
        args.extend(more);
        command(&args).output().expect("the program starts")
    };
    assert!(render("1", &[]).status.success());
    let bytes = std::fs::metadata(&film).unwrap().len();
    let enough = |limit: u64, more: &[&str]| {
        let limit = limit.to_string();
        let mut args = vec!["--memory", limit.as_str()];
        args.extend(more);
        render("2", &args).status.success()
    };
    // The least that a fresh render gets along with, to a tenth of the film.
    let (mut too_little, mut least) = (0, 1 << 32);
    while least - too_little > bytes / 10 {
        let middle = u64::midpoint(too_little, least);
        if enough(middle, &[]) {
            least = middle;
        } else {
            too_little = middle;
        }
    }
    assert!(render("1", &[]).status.success());
    assert!(!enough(least + bytes / 2, &["--resume"]));
    assert!(enough(least + bytes * 11 / 10, &["--resume"]));
}
