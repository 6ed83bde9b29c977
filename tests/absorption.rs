//! Objects that are filled with something that absorbs.

use crate::common::{Settings, image, load};
use smithwalk::features::Features;
use std::path::{Path, PathBuf};

/// The faces of a box from −`half` to `half`, seen from outside counter-clockwise.
fn cube(half: f32) -> String {
    let corners: String = (0..8)
        .map(|i| {
            let side = |bit: u32| if i & bit == 0 { -half } else { half };
            format!("v {} {} {}\n", side(1), side(2), side(4))
        })
        .collect();
    corners + "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n"
}

/// A scene in a directory of its own, seen from straight above.
fn scene(name: &str, materials: &str, rest: &str) -> PathBuf {
    let directory = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("absorption-{name}"));
    std::fs::create_dir_all(&directory).unwrap();
    std::fs::write(directory.join("cube.obj"), cube(0.5)).unwrap();
    let floor = "v -1 -1 -0.2\nv 1 -1 -0.2\nv 1 1 -0.2\nv -1 1 -0.2\nf 1 2 3 4\n";
    std::fs::write(directory.join("floor.obj"), floor).unwrap();
    let text = format!(
        "smithwalk: 1\n\
         camera: {{projection: {{orthographic: {{scale: 0.3}}}}, transform: {{look_at: {{from: [0.02, 0.03, 5], to: [0.02, 0.03, 0], up: [0, 1, 0]}}}}}}\n\
         film: {{width: 16, height: 16}}\n\
         sampling: {{max_bounces: 64, roulette_start: 64}}\n\
         meshes: {{cube: {{file: cube.obj}}, floor: {{file: floor.obj}}}}\n\
         materials: {{{materials}}}\n\
         {rest}\n"
    );
    let path = directory.join("scene.yaml");
    std::fs::write(&path, text).unwrap();
    path
}

/// The mean colour of the image.
fn mean(path: &Path, spp: u32) -> [f64; 3] {
    let image = image(path, &[], Settings::spp(spp), &[]);
    let count = image.color.len() as f64;
    [0, 1, 2].map(|c| image.color.iter().map(|p| f64::from(p[c])).sum::<f64>() / count)
}

fn assert_close(found: [f64; 3], expected: [f64; 3], tolerance: f64) {
    for c in 0..3 {
        let off = (found[c] - expected[c]).abs();
        assert!(
            off <= tolerance * expected[c],
            "{found:?}, not {expected:?}"
        );
    }
}

const WHITE: &str = "world: {constant: {color: 1}}\n";

#[test]
fn light_that_goes_straight_through_is_absorbed_by_distance() {
    let path = scene(
        "straight",
        "dye: {filled: {surface: {transparent: {}}, absorption: [0.5, 2, 0]}}",
        &format!("{WHITE}objects: [{{mesh: cube, material: dye}}]"),
    );
    assert!(
        load(&path, &[])
            .scene
            .features
            .contains(Features::ABSORPTION)
    );
    assert_close(
        mean(&path, 1),
        [(-0.5_f64).exp(), (-2.0_f64).exp(), 1.0],
        1e-5,
    );
}

/// Of an object inside of another, both absorb.
#[test]
fn what_fills_the_same_space_absorbs_together() {
    let path = scene(
        "nested",
        "dye: {filled: {surface: {transparent: {}}, transmittance: [0.8, 0.5, 1], depth: 0.5}}, ink: {filled: {surface: {transparent: {color: 0.9}}, absorption: [0, 0, 3]}}",
        &format!(
            "{WHITE}objects: [{{mesh: cube, material: dye}}, {{mesh: cube, material: ink, transform: {{scale: 0.4}}}}]"
        ),
    );
    let twice = 0.81;
    let expected = [0.64 * twice, 0.25 * twice, (-1.2_f64).exp() * twice];
    assert_close(mean(&path, 1), expected, 1e-5);
}

/// A floor below 0.7 m of dye: light of the sun crosses it down and up.
#[test]
fn light_samples_are_absorbed_on_their_way() {
    let path = scene(
        "sun",
        "dye: {filled: {surface: {transparent: {}}, absorption: [1, 0.2, 0]}}, ground: {diffuse: {color: 0.5}}",
        "objects: [{mesh: cube, material: dye}, {mesh: floor, material: ground}]\nlights: [{sun: {strength: 3}}]",
    );
    let lit = 3.0 * 0.5 / std::f64::consts::PI;
    let expected = [1.0, 0.2, 0.0].map(|sigma: f64| lit * (-1.4 * sigma).exp());
    assert_close(mean(&path, 1), expected, 1e-5);
}

/// A lamp of 0.3 m that floats in dye above the floor, met by samples of both kinds: with
/// light samples and without them, for the dye and without it. What is seen of it has
/// come through 0.5 m of dye, over a lens-shaped range of distances.
#[test]
fn lamps_inside_are_absorbed_in_either_way() {
    let lit = |dye: f32, roughness: f32| {
        let path = scene(
            &format!("lamp-{dye}-{roughness}"),
            &format!(
                "dye: {{filled: {{surface: {{transparent: {{}}}}, absorption: {dye}}}}}, ground: {{conductor: {{roughness: {roughness}}}}}"
            ),
            "objects: [{mesh: cube, material: dye}, {mesh: floor, material: ground}]\nlights: [{area: {power: 3, shape: {disk: {width: 0.6, height: 0.6}}, transform: {location: [0, 0, 0.3]}}}]",
        );
        mean(&path, 64)[0]
    };
    // The mirror meets the lamp by BSDF samples alone. 0.7 m from the camera's side, 0.5 m
    // to the lamp.
    let mirror = lit(1.5, 0.0) / lit(1e-9, 0.0);
    assert!(
        (mirror / (-1.5_f64 * 1.2).exp() - 1.0).abs() < 1e-4,
        "{mirror}"
    );
    let rough = lit(1.5, 0.3) / lit(1e-9, 0.3);
    assert!(
        (rough / mirror - 1.0).abs() < 0.03,
        "{rough}, about {mirror}"
    );
}

/// Smooth glass of 1 m, seen along its normal: R + (1 − R)² t/(1 − R t) of the light
/// from everywhere, t = e^−σ.
#[test]
fn glass_absorbs_at_every_crossing() {
    let path = scene(
        "glass",
        "glass: {filled: {surface: {dielectric: {alpha: 0, ior: 1.5}}, absorption: [0.3, 1.5, 0]}}",
        &format!("{WHITE}objects: [{{mesh: cube, material: glass}}]"),
    );
    let r = 0.04;
    let expected = [0.3, 1.5, 0.0].map(|sigma: f64| {
        let t = (-sigma).exp();
        r + (1.0 - r) * (1.0 - r) * t / (1.0 - r * t)
    });
    assert_close(mean(&path, 48), expected, 4e-3);
}
