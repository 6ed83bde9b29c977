//! Where textures are looked up, and what alpha does to them.

use std::path::PathBuf;

use crate::common::folder;
use glam::Vec3;
use smithwalk::description::Description;
use smithwalk::embree::Ray;
use smithwalk::features::Features;
use smithwalk::scene::{View, resolve};
use smithwalk::texture::{
    Alpha, ColorSpace, Extension, Interpolation, Lookup, Texture, UvTransform,
};

/// Four greys side by side.
const GREYS: [u8; 4] = [0, 60, 120, 240];

fn greys(name: &str) -> PathBuf {
    let path = folder("textures").join(name);
    let image = image::GrayImage::from_raw(4, 1, GREYS.to_vec()).unwrap();
    image.save(&path).unwrap();
    path
}

/// The red of the texture at (u, 0.5), times 255.
fn at(texture: &Texture, u: f32) -> f32 {
    texture.sample([u, 0.5])[0] * 255.0
}

fn close(found: f32, expected: f32) {
    assert!((found - expected).abs() < 1e-3, "{found}, not {expected}");
}

#[test]
fn what_is_beyond_the_edges() {
    let path = greys("beyond.png");
    let load = |extension, interpolation| {
        let lookup = Lookup {
            extension,
            interpolation,
            ..Lookup::default()
        };
        Texture::load(&path, lookup).unwrap().0
    };
    use Extension::{Clip, Extend, Mirror, Repeat};
    // At the centres of the pixels from −5 to 8.
    for (extension, expected) in [
        (
            Repeat,
            [240, 0, 60, 120, 240, 0, 60, 120, 240, 0, 60, 120, 240, 0],
        ),
        (Clip, [0, 0, 0, 0, 0, 0, 60, 120, 240, 0, 0, 0, 0, 0]),
        (
            Extend,
            [0, 0, 0, 0, 0, 0, 60, 120, 240, 240, 240, 240, 240, 240],
        ),
        (
            Mirror,
            [240, 240, 120, 60, 0, 0, 60, 120, 240, 240, 120, 60, 0, 0],
        ),
    ] {
        for interpolation in [Interpolation::Closest, Interpolation::Bilinear] {
            let texture = load(extension, interpolation);
            for (pixel, expected) in (-5..).zip(expected) {
                close(at(&texture, (pixel as f32 + 0.5) / 4.0), expected as f32);
            }
        }
        for u in [f32::MAX, -f32::MAX, f32::NAN, f32::INFINITY] {
            for interpolation in [
                Interpolation::Closest,
                Interpolation::Bilinear,
                Interpolation::Cubic,
            ] {
                assert!(load(extension, interpolation).sample([u, u])[0].is_finite());
            }
        }
    }
    // Half a pixel in and half out.
    close(at(&load(Clip, Interpolation::Bilinear), 1.0), 120.0);
    close(at(&load(Extend, Interpolation::Bilinear), 1.0), 240.0);
    close(
        load(Clip, Interpolation::Closest).sample([1.1, 0.5])[3],
        0.0,
    );
}

/// The B-spline's weights at a pixel's centre are 1/6, 2/3 and 1/6.
#[test]
fn cubic_interpolation_is_the_b_spline() {
    let lookup = Lookup {
        interpolation: Interpolation::Cubic,
        extension: Extension::Extend,
        ..Lookup::default()
    };
    let (texture, _) = Texture::load(&greys("cubic.png"), lookup).unwrap();
    close(at(&texture, 0.375), (0.0 + 4.0 * 60.0 + 120.0) / 6.0);
    // 1/48, 23/48, 23/48 and 1/48 between two.
    close(
        at(&texture, 0.5),
        (0.0 + 23.0 * 60.0 + 23.0 * 120.0 + 240.0) / 48.0,
    );
}

#[test]
fn rotation_and_matrix_place_alike() {
    let path = greys("turned.png");
    let load = |transform| {
        let lookup = Lookup {
            transform,
            ..Lookup::default()
        };
        Texture::load(&path, lookup).unwrap().0
    };
    // A quarter turn takes v to −u.
    let turned = load(UvTransform::from_parts([2.0, 3.0], 90.0, [0.25, 0.0]));
    let rows = load(UvTransform::from_rows([[0.0, -3.0, 0.25], [2.0, 0.0, 0.0]]));
    let plain = load(UvTransform::default());
    for [u, v] in [[0.1f32, 0.3], [0.7, -0.2], [-3.1, 0.9]] {
        close(turned.sample([u, v])[0] * 255.0, at(&plain, 0.25 - 3.0 * v));
        close(
            turned.sample([u, v])[0] * 255.0,
            rows.sample([u, v])[0] * 255.0,
        );
    }
}

/// Two pixels: opaque 200, and 100 of alpha 51/255. Products of whole numbers are cut
/// off, as in Cycles.
#[test]
fn alpha_multiplies_divides_and_weighs() {
    let path = folder("textures").join("alpha.png");
    let image = image::GrayAlphaImage::from_raw(2, 1, vec![200, 255, 99, 51]).unwrap();
    image.save(&path).unwrap();
    let load = |alpha, color_space| {
        let lookup = Lookup {
            alpha,
            color_space,
            extension: Extension::Extend,
            ..Lookup::default()
        };
        Texture::load(&path, lookup).unwrap().0
    };
    for (alpha, left, middle, right) in [
        (Alpha::AsIs, 200.0, 149.5, 99.0),
        (Alpha::Multiply, 200.0, 109.5, 19.0),
        (Alpha::Divide, 200.0, 149.5 / 0.6, 99.0 / 0.2),
        (Alpha::Weigh, 200.0, 109.5 / 0.6, 19.0 / 0.2),
    ] {
        let texture = load(alpha, ColorSpace::NonColor);
        close(at(&texture, 0.0), left);
        close(at(&texture, 0.5), middle);
        close(at(&texture, 1.0), right);
        close(texture.sample([0.5, 0.5])[3], 0.6);
    }
    // Decoded when all of that is done.
    let decoded = load(Alpha::Multiply, ColorSpace::Srgb).sample([1.0, 0.5])[0];
    close(decoded, ((19.0 / 255.0 + 0.055) / 1.055f32).powf(2.4));
}

#[test]
fn tiles_are_squares_of_texture_coordinates() {
    let folder = folder("tiles");
    for (number, grey) in [(1001, 10), (1002, 20), (1012, 30)] {
        let image = image::GrayImage::from_pixel(2, 2, image::Luma([grey]));
        image.save(folder.join(format!("t.{number}.png"))).unwrap();
    }
    std::fs::write(folder.join("t.99.png"), "no tile").unwrap();
    let path = folder.join("t.<UDIM>.png");
    let (texture, _) = Texture::load(&path, Lookup::default()).unwrap();
    for (uv, expected) in [
        ([0.5, 0.5], 10.0),
        ([1.9, 0.1], 20.0),
        ([1.5, 1.5], 30.0),
        ([0.5, 1.5], 255.0),
        ([-3.0, 0.5], 255.0),
        ([10.5, 0.5], 255.0),
    ] {
        close(texture.sample(uv)[0] * 255.0, expected);
    }
    assert_eq!(Texture::memory(&[texture.clone(), texture]), 12);
    let missing = Texture::load(&folder.join("u.<UDIM>.png"), Lookup::default());
    let error = missing.expect_err("no tile").to_string();
    assert!(
        error.ends_with("such as `u.1001.png`, found none"),
        "{error}"
    );
}

#[test]
fn mistakes_are_told_at_their_place() {
    for (keys, expected) in [
        (
            "matrix: [[1, 0, 0], [0, 1, 0]], rotation: 3",
            "`matrix` and `rotation` exclude each other",
        ),
        (
            "matrix: [[1, 2, 0], [2, 4, 0]]",
            "this matrix has no inverse",
        ),
        ("scale: [0, 1]", "expected factors other than 0"),
        (
            "extension: wrap",
            "expected `repeat`, `clip`, `extend` or `mirror`, found `wrap`",
        ),
        (
            "alpha: straight",
            "expected `as_is`, `multiply`, `divide` or `weigh`, found `straight`",
        ),
    ] {
        let text = format!("smithwalk: 1\ntextures: {{t: {{file: t.png, {keys}}}}}\n");
        let error = Description::from_str(&text, "scene", &[]).expect_err(keys);
        let error = error.to_string();
        assert!(
            error.contains("scene:2:") && error.contains(expected),
            "{keys}: {error}"
        );
    }
}

/// A square, its texture coordinates and colours in other files.
fn attributes(name: &str, second: &str) -> PathBuf {
    let folder = folder(name);
    greys("greys.png");
    std::fs::copy(
        crate::common::folder("textures").join("greys.png"),
        folder.join("greys.png"),
    )
    .unwrap();
    let corners = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\n";
    let write = |file: &str, text: String| std::fs::write(folder.join(file), text).unwrap();
    write(
        "quad.obj",
        format!("{corners}vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n"),
    );
    write("second.obj", format!("{corners}{second}"));
    write(
        "paint.obj",
        "v -1 -1 0 0.5 0 0\nv 1 -1 0 0 1 0\nv 1 1 0 0.5 0 1\nv -1 1 0 1 1 1\nf 1 2 3 4\n"
            .to_owned(),
    );
    write(
        "scene.yaml",
        "smithwalk: 1\n\
         textures:\n  first: {file: greys.png}\n  other: {file: greys.png, uv_map: second}\n  \
           paint: {colors: paint, color_space: srgb}\n\
         materials:\n  m: {diffuse: {color: {texture: other}}}\n  n: {diffuse: {color: {texture: paint}}}\n\
         meshes: {quad: {file: quad.obj, uv_maps: {second: second.obj}, colors: {paint: paint.obj}}, bare: {file: quad.obj}}\n\
         objects: [{mesh: quad, material: m}]\n"
            .to_owned(),
    );
    folder.join("scene.yaml")
}

/// The colour where the line down at (x, y) meets a scene.
fn color_at(path: &std::path::Path, overrides: &[(&str, &str)], x: f32, y: f32) -> [f32; 3] {
    let scene = crate::common::load(path, overrides).scene;
    let ray = Ray::new(Vec3::new(x, y, 5.0), -Vec3::Z);
    let hit = scene
        .accelerator
        .intersect(ray)
        .expect("the square is there");
    let surface = scene.surface::<{ Features::EVERYTHING.bits() }>(&ray, &hit);
    let view = View {
        wo: Vec3::Z,
        camera: true,
    };
    scene.albedo(&surface, view).to_array()
}

/// The second map is turned by a quarter and has a seam between the two triangles.
#[test]
fn textures_look_at_other_uv_maps() {
    let second = "vt 0 0\nvt 0 1\nvt 1 1\nvt 1 0\nvt 0.375 0\nf 1/1 2/2 3/3\nf 1/5 3/5 4/5\n";
    let path = attributes("uv-maps", second);
    // Where u is 0.625: the third grey.
    close(color_at(&path, &[], 0.75, 0.25)[0] * 255.0, 120.0);
    close(color_at(&path, &[], 0.25, 0.75)[0] * 255.0, 60.0);
    // Its own are as they were.
    let own = [("materials.m.diffuse.color.texture", "first")];
    close(color_at(&path, &own, -0.25, 0.9)[0] * 255.0, 60.0);
}

#[test]
fn colors_of_vertices_are_textures() {
    let path = attributes("vertex-colors", "vt 0 0\nf 1/1 2/1 3/1 4/1\n");
    let paint = [("objects.0.material", "n")];
    // Half way between the second and the third corner, decoded before.
    let half = 0.5 * ((0.5f32 + 0.055) / 1.055).powf(2.4);
    let [r, g, b] = color_at(&path, &paint, 0.999_999, 0.0);
    close(r, half);
    close(g, 0.5);
    close(b, 0.5);
}

#[test]
fn what_meshes_lack_is_told() {
    let path = attributes("lacks", "vt 0 0\nf 1/1 2/1 3/1\n");
    let refuse = |overrides: &[(&str, &str)]| {
        let overrides: Vec<_> = overrides
            .iter()
            .map(|(key, value)| ((*key).to_owned(), (*value).to_owned()))
            .collect();
        let description = Description::load(&path, &overrides).unwrap_or_else(|e| panic!("{e}"));
        resolve(&description).expect_err("refused").to_string()
    };
    let error = refuse(&[]);
    assert!(
        error.ends_with("second.obj: expected the faces of the mesh, 2 triangles, found 1"),
        "{error}"
    );
    let error = refuse(&[("objects.0", "{mesh: bare, material: n}")]);
    let expected = "scene.yaml:5:19: textures.paint.colors: this needs set of colours paint, \
                    which the mesh `bare` of objects.0 lacks";
    assert!(error.ends_with(expected), "{error}");
    let error = refuse(&[
        ("objects.0", "{mesh: quad, material: n}"),
        ("meshes.quad.colors.paint", "quad.obj"),
    ]);
    assert!(
        error.contains("quad.obj:1: expected 6 numbers after `v`, found 3"),
        "{error}"
    );
    let unknown = Description::load(&path, &[("textures.other.uv_map".into(), "secnd".into())]);
    let error = unknown.expect_err("no such map").to_string();
    assert!(
        error.contains("no mesh has the UV map `secnd`; did you mean `second`?"),
        "{error}"
    );
    let both = Description::load(&path, &[("textures.paint.file".into(), "greys.png".into())]);
    let error = both.expect_err("both").to_string();
    assert!(
        error.contains("`file` and `colors` exclude each other"),
        "{error}"
    );
}
