#![no_main]
//! Changes on the command line, `-D path=value`, of a scene that has something of all.

use libfuzzer_sys::fuzz_target;
use smithwalk::description::Description;

const SCENE: &str = "smithwalk: 1
camera: {projection: {perspective: {fov: 40}}}
film: {width: 8, filter: {box: {}}}
world: {constant: {color: 1}}
textures: {t: {file: t.png}}
materials: {m.n: {diffuse: {color: {texture: t}}}, c: {conductor: {alpha: .1}}}
meshes: {a: {file: a.obj}}
objects: [{mesh: a, materials: {x: c}, transform: {location: [0, 0, 0]}}]
lights: [point: {power: 1}]
";

fuzz_target!(|text: &str| {
    let changes: Vec<(String, String)> = text
        .split('\0')
        .filter_map(|change| change.split_once('='))
        .map(|(path, value)| (path.to_owned(), value.to_owned()))
        .collect();
    let _ = Description::from_str(SCENE, "scene.yaml", &changes);
});
