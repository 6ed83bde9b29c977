#![no_main]
//! A frame's file, of a scene that has something of all.

use libfuzzer_sys::fuzz_target;
use smithwalk::description::Animation;
use std::sync::LazyLock;

const SCENE: &str = "smithwalk: 1
frames: moves/####.yaml
camera: {projection: {perspective: {fov: 40}}}
world: {constant: {color: 1}}
textures: {t: {file: t.png}}
materials: {m.n: {diffuse: {color: {texture: t}}}, c: {conductor: {alpha: .1}}}
meshes: {a: {file: a.obj}}
objects: [{mesh: a, materials: {x: c}, transform: {location: [0, 0, 0]}}]
lights: [point: {power: 1}]
";

static ANIMATION: LazyLock<Animation> = LazyLock::new(|| {
    let path = std::path::PathBuf::from(format!("/dev/shm/smithwalk-fuzz-{}.yaml", std::process::id()));
    std::fs::write(&path, SCENE).expect("there is room in /dev/shm");
    Animation::load(&path, &[]).expect("nothing is wrong with it")
});

fuzz_target!(|text: &str| {
    if let Err(problems) = ANIMATION.frame_from(text, "0001.yaml") {
        assert!(problems.to_string().len() < 200_000);
    }
});
