//! Where textures are looked up, and what alpha does to them.

use std::path::PathBuf;

use crate::common::folder;
use smithwalk::description::Description;
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
