//! Animations through the command: what frames change, in any order and any number.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::Duration;

use smithwalk::image::{Image, read_exr};
use smithwalk::memory::Budget;
use smithwalk::scene::Stage;

/// A floor with a texture and a second ball that stand still, a ball that moves, a flag
/// whose mesh is another in each frame.
const SCENE: &str = "smithwalk: 1
frames: moves/####.yaml
camera: {projection: {perspective: {fov: 40}}, transform: {look_at: {from: [0, -4, 2], to: [0, 0, 0.3]}}}
film: {width: 40, height: 30}
sampling: {spp: 4}
world: {environment: {file: w.hdr}}
lights: [{area: {shape: {rectangle: {width: 0.3, height: 0.3}}, power: 20, transform: {look_at: {from: [1, -1, 2], to: [0, 0, 0]}}}}]
textures: {t: {file: t.png, color_space: srgb}}
materials:
  m: {rough_diffuse: {alpha: 0.5, color: {texture: t}}}
  gold: {conductor: {metal: gold, roughness: 0.6}}
meshes: {floor: {file: floor.obj}, block: {file: block.obj}, flag: {file: flag_1.obj}, post: {file: post.obj}}
objects:
  - {mesh: floor, material: m}
  - {mesh: block, material: gold, transform: {location: [-0.8, 0, 0.2]}}
  - {mesh: flag, material: gold}
  - {mesh: post, material: m, transform: {location: [1, 0.5, 0]}}
";

struct Stands(PathBuf);

impl Drop for Stands {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

impl Stands {
    fn new(name: &str) -> Self {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("frames-{name}"));
        let _ = std::fs::remove_dir_all(&folder);
        std::fs::create_dir_all(folder.join("moves")).unwrap();
        let stands = Self(folder);
        stands.write("scene.yaml", SCENE);
        stands.quad(
            "floor.obj",
            [-2.0, -2.0, 0.0],
            [4.0, 0.0, 0.0],
            [0.0, 4.0, 0.0],
        );
        stands.quad(
            "block.obj",
            [0.0, 0.0, 0.0],
            [0.5, 0.0, 0.1],
            [0.0, 0.1, 0.5],
        );
        stands.quad(
            "post.obj",
            [0.0, 0.0, 0.0],
            [0.2, 0.0, 0.0],
            [0.0, 0.1, 1.0],
        );
        for frame in 1..=3u8 {
            let lift = 0.2 * f32::from(frame);
            let flag = format!("flag_{frame}.obj");
            stands.quad(&flag, [0.3, 0.2, 0.4], [0.5, lift, 0.0], [0.0, 0.1, 0.3]);
            let moves = format!(
                "objects.1.transform.location: [{lift}, 0, 0.3]\nmeshes.flag.file: {flag}\nlights.0.area.power: {}\ncamera.transform.look_at.from: [{lift}, -4, 2]\n",
                10 * frame
            );
            stands.write(&format!("moves/000{frame}.yaml"), &moves);
        }
        let mut image = image::GrayImage::from_pixel(4, 4, image::Luma([200]));
        image.put_pixel(1, 1, image::Luma([30]));
        image.save(stands.0.join("t.png")).unwrap();
        image::Rgb32FImage::from_pixel(8, 4, image::Rgb([0.5, 0.4, 0.3]))
            .save(stands.0.join("w.hdr"))
            .unwrap();
        stands
    }

    fn write(&self, name: &str, text: &str) {
        std::fs::write(self.0.join(name), text).unwrap();
    }

    /// A parallelogram: a corner and two sides.
    fn quad(&self, name: &str, corner: [f32; 3], a: [f32; 3], b: [f32; 3]) {
        let vertex = |s: f32, t: f32| {
            let [x, y, z] = std::array::from_fn(|i| corner[i] + s * a[i] + t * b[i]);
            format!("v {x} {y} {z}\n")
        };
        let vertices = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
        let vertices = vertices.map(|(s, t)| vertex(s, t)).concat();
        let uvs = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";
        self.write(name, &format!("{vertices}{uvs}f 1/1 2/2 3/3 4/4\n"));
    }

    fn command(&self, more: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_smithwalk"));
        command.args(["render", "scene.yaml"]).args(more);
        command.current_dir(&self.0);
        command
    }

    fn render(&self, more: &[&str]) -> Output {
        let output = self.command(more).output().expect("the program starts");
        let log = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{more:?}: {log}");
        output
    }

    fn refused(&self, more: &[&str]) -> String {
        let output = self.command(more).output().expect("the program starts");
        assert!(!output.status.success(), "{more:?}");
        String::from_utf8(output.stderr).unwrap()
    }

    fn image(&self, name: &str) -> Image {
        read_exr(&self.0.join(name)).unwrap()
    }

    fn exists(&self, name: &str) -> bool {
        self.0.join(name).exists()
    }
}

/// Each frame has the bits of a render of it alone, by any number of threads; and what
/// it shows is the scene with these values.
#[test]
fn frames_in_a_row_are_those_rendered_alone() {
    let stands = Stands::new("alone");
    stands.render(&["--frames", "1..3", "-o", "row_##.exr"]);
    for frame in ["1", "2", "3"] {
        let row = stands.image(&format!("row_0{frame}.exr"));
        stands.render(&["--frames", frame, "-o", "alone.exr", "--threads", "3"]);
        assert_eq!(row.color, stands.image("alone.exr").color, "frame {frame}");

        let lift = 0.2 * frame.parse::<f32>().unwrap();
        let values = [
            format!("objects.1.transform.location=[{lift}, 0, 0.3]"),
            format!("meshes.flag.file=flag_{frame}.obj"),
            format!("lights.0.area.power={frame}0"),
            format!("camera.transform.look_at.from=[{lift}, -4, 2]"),
        ];
        let mut arguments = vec!["-o", "given.exr"];
        arguments.extend(values.iter().flat_map(|value| ["-D", value]));
        stands.render(&arguments);
        // Instances round otherwise than meshes in world space, here and there by a
        // path that goes elsewhere.
        let given = stands.image("given.exr");
        let pixels = given.color.iter().zip(&row.color);
        let apart = pixels.filter(|(a, b)| (a[1] - b[1]).abs() > 1e-3 * (a[1] + b[1]));
        let apart = apart.count();
        assert!(
            apart < given.color.len() / 50,
            "{apart} pixels of frame {frame}"
        );
    }
    assert_ne!(
        stands.image("row_01.exr").color,
        stands.image("row_02.exr").color
    );
    // The scene file alone is a scene.
    stands.render(&["-o", "still.exr"]);
    let default = stands.render(&["--frames", "3", "--spp", "1"]);
    assert!(String::from_utf8_lossy(&default.stdout).contains("scene_0003.exr"));
    assert!(stands.exists("scene_0003.png"));
}

/// What stands still is neither read nor built again.
#[test]
fn what_stands_still_is_kept() {
    let stands = Stands::new("kept");
    let animation = smithwalk::description::Animation::load(&stands.0.join("scene.yaml"), &[]);
    let animation = animation.unwrap();
    let mut stage = Stage::new(animation.camera());
    let mut resolve = |number: i32| {
        let frame = animation.frame(number).unwrap();
        let resolved = stage.resolve(&frame, &Budget::of_machine()).unwrap();
        let scene = resolved.scene;
        let vertices = |object: usize| scene.meshes[scene.objects[object].mesh].vertices.as_ptr();
        let found = [0, 1, 2, 3].map(vertices);
        stage.take_back(scene);
        (found, resolved.identity)
    };
    let (first, one) = resolve(1);
    for name in [
        "floor.obj",
        "block.obj",
        "post.obj",
        "flag_1.obj",
        "t.png",
        "w.hdr",
    ] {
        std::fs::remove_file(stands.0.join(name)).unwrap();
    }
    let (second, two) = resolve(2);
    assert_eq!([0, 1, 3].map(|i| first[i]), [0, 1, 3].map(|i| second[i]));
    for same in [
        "mesh `floor`",
        "mesh `block`",
        "texture `t`",
        "world",
        "object 0",
    ] {
        assert_eq!(one[same], two[same], "{same}");
    }
    for other in ["mesh `flag`", "object 1", "light 0", "camera"] {
        assert_ne!(one[other], two[other], "{other}");
    }
}

/// Killed at any moment, a row of frames goes on where it was: frames that are complete
/// are not rendered again, the one that was not goes on, and no film stays.
#[test]
fn a_row_of_frames_goes_on_after_kills() {
    let stands = Stands::new("kills");
    let row = [
        "--frames",
        "1..3",
        "--spp",
        "24",
        "-D",
        "film.width=16",
        "-D",
        "film.height=12",
        "--checkpoint",
        "0.02",
        "--resume",
    ];
    for kill in 0..6 {
        let mut child = stands.command(&[&row[..], &["-o", "a_#.exr"]].concat());
        let mut child = child
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_millis(60 + 50 * kill));
        let signal = if kill % 2 == 0 { "-9" } else { "-TERM" };
        let id = child.id().to_string();
        Command::new("kill").args([signal, &id]).status().unwrap();
        child.wait().unwrap();
    }
    stands.render(&[&row[..], &["-o", "a_#.exr"]].concat());
    stands.render(&[&row[..], &["-o", "b_#.exr"]].concat());
    for frame in 1..=3 {
        let [a, b] = ["a", "b"].map(|name| stands.image(&format!("{name}_{frame}.exr")));
        assert_eq!(a.color, b.color, "frame {frame}");
        assert!(!stands.exists(&format!("a_{frame}.exr.film")));
    }
    let again = stands.render(&[&row[..], &["-o", "a_#.exr"]].concat());
    let said = String::from_utf8_lossy(&again.stdout);
    assert_eq!(
        said,
        "frame 1 is complete\nframe 2 is complete\nframe 3 is complete\n"
    );
    // With other settings it is not.
    let more = ["--frames", "1", "--spp", "2", "--resume", "-o", "a_#.exr"];
    let said = stands.render(&more);
    assert!(!String::from_utf8_lossy(&said.stdout).contains("complete"));
}

/// Parts of frames merge to the frames.
#[test]
fn frames_have_parts() {
    let stands = Stands::new("parts");
    stands.render(&["--frames", "2", "-o", "whole.exr"]);
    for part in ["0/2", "1/2"] {
        let name = format!("p{}_#.film", &part[..1]);
        stands.render(&["--frames", "2..3", "--part", part, "-o", &name]);
    }
    let merged = Command::new(env!("CARGO_BIN_EXE_smithwalk"))
        .args(["merge", "p1_2.film", "p0_2.film", "-o", "merged.exr"])
        .current_dir(&stands.0)
        .status();
    assert!(merged.unwrap().success());
    assert_eq!(
        stands.image("merged.exr").color,
        stands.image("whole.exr").color
    );
    // The frame that was merged is as complete as one that was rendered.
    let merged = ["--frames", "2", "-o", "merged.exr", "--resume"];
    let said = stands.render(&merged);
    assert_eq!(
        String::from_utf8_lossy(&said.stdout),
        "frame 2 is complete\n"
    );
    // A film of a frame is not one of another frame.
    let log = stands.refused(&[
        "--frames",
        "2",
        "-o",
        "p0_3.film",
        "--part",
        "0/2",
        "--resume",
    ]);
    assert!(log.contains("another"), "{log}");
}

/// What is wrong is told before anything is rendered, with its place.
#[test]
fn mistakes_in_frames_are_told_first() {
    let stands = Stands::new("mistakes");
    let row = |last: &str, output: &str| stands.refused(&["--frames", last, "-o", output]);
    let log = row("1..4", "a_#.exr");
    assert!(log.contains("0004.yaml: the scene can't be read"), "{log}");
    let log = row("1..2", "a.exr");
    assert!(log.contains("one row of at most 32 #"), "{log}");
    for (text, told) in [
        (
            "camera.transform: {location: [0, 0, 1]}\nobjects.9.transform: {location: [0, 0, 1]}\n",
            "moves/0003.yaml:2:1: objects: expected an index below 4, found `9`",
        ),
        (
            "objects.1.transfrom: {location: [0, 0, 1]}",
            "moves/0003.yaml:1:1: objects.1.transfrom: unknown key",
        ),
        (
            "meshes.flog.file: a.obj",
            "moves/0003.yaml:1:1: meshes: the scene has no `flog` here; did you mean `flag`?",
        ),
        (
            "lights.0.area.power: -3",
            "moves/0003.yaml:1:22: lights.0.area.power: expected a number, 0 or more, found -3",
        ),
        (
            "[1, 2]",
            "moves/0003.yaml:1:1: expected a mapping from paths to values, found a list of 2",
        ),
        (
            "meshes.flag.file: flag_9.obj",
            "frame 3: the mesh `flag` has no file",
        ),
    ] {
        stands.write("moves/0003.yaml", text);
        let log = row("1..3", "a_#.exr");
        assert!(log.contains(told), "{text}: {log}");
        assert!(!stands.exists("a_1.exr"));
    }
    // A frame without a word is as the scene file has it.
    stands.write("moves/0003.yaml", "# nothing\n");
    stands.render(&["--frames", "3", "-o", "a.exr", "--spp", "1"]);
    stands.write(
        "scene.yaml",
        &SCENE.replace("frames: moves/####.yaml\n", ""),
    );
    let log = row("1..2", "a_#.exr");
    assert!(log.contains("the key `frames` is missing"), "{log}");
    let long = "#".repeat(70_000);
    stands.write("scene.yaml", &SCENE.replace("####", &long));
    let log = row("1..2", "a_#.exr");
    assert!(
        log.contains("expected one row") && log.len() < 1000,
        "{log}"
    );
    stands.write("scene.yaml", &SCENE.replace("####", "frame"));
    let log = row("1..2", "a_#.exr");
    assert!(
        log.contains("scene.yaml:2:9: frames: expected one row of at most 32 #"),
        "{log}"
    );
}
