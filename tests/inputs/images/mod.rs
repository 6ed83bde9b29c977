//! Image files: the colours of what is read, or what is said.

mod jpeg;
mod openexr;
mod png;
mod radiance;
mod tiff;

use super::{assert_none, directory};
use png::png;
use smithwalk::memory::Budget;
use smithwalk::texture::{ColorSpace, Images, Interpolation, Lookup, Texture, UvTransform};
use std::path::Path;

/// What becomes of a file.
enum Becomes {
    /// This mean of all pixels, and nothing to tell.
    Mean([f32; 3]),
    /// As above, and this is told.
    Told([f32; 3], &'static str),
    /// This is said.
    Refused(&'static str),
}
use Becomes::{Mean, Refused, Told};

fn load(path: &Path) -> std::result::Result<(Texture, Vec<String>), String> {
    let budget = Budget::new(1 << 30);
    let images = Images::new(&budget);
    images
        .texture(path, Lookup { color_space: ColorSpace::NonColor, interpolation: Interpolation::Closest, ..Lookup::default() })
        .map(|(texture, repairs)| (texture, repairs.iter().map(ToString::to_string).collect()))
        .map_err(|error| error.to_string())
}

fn check(name: &str, within: f32, cases: &[(&str, Vec<u8>, Becomes)]) {
    let path = directory(name).join("image");
    let mut faults = Vec::new();
    for (what, bytes, becomes) in cases {
        std::fs::write(&path, bytes).unwrap();
        let found = match (load(&path), becomes) {
            (Ok((texture, repairs)), Mean(mean) | Told(mean, _)) => {
                let found = texture.mean();
                let near = found.iter().zip(mean).all(|(a, b)| (a - b).abs() <= within);
                let told = match becomes {
                    Told(_, told) => repairs.iter().any(|repair| repair.contains(told)),
                    _ => repairs.is_empty(),
                };
                if near && told {
                    continue;
                }
                format!("{found:?}, {repairs:?}")
            }
            (Ok((texture, repairs)), Refused(_)) => format!("{:?}, {repairs:?}", texture.mean()),
            (Err(error), Refused(message)) if error.contains(message) && error.len() < 1000 => {
                continue;
            }
            (Err(error), _) => error,
        };
        faults.push(format!("{what}: {found}"));
    }
    assert_none(&faults);
}

#[test]
fn an_image_under_many_names_is_read_and_kept_once() {
    let folder = directory("shared");
    std::fs::write(folder.join("a"), png(2, 8, 2, &[], &[&[0; 6], &[0; 6]])).unwrap();
    let budget = Budget::new(12);
    let images = Images::new(&budget);
    let names = ["a", "./a", "../shared/a"];
    let textures: Vec<Texture> = (0..300)
        .map(|i| {
            let path = folder.join(names[i % 3]);
            let scale = [1.0 + i as f32; 2];
            images.texture(&path, Lookup { color_space: ColorSpace::Srgb, transform: UvTransform::from_parts(scale, 0.0, [0.0; 2]), ..Lookup::default() }).unwrap().0
        })
        .collect();
    assert_eq!(Texture::memory(&textures), 12);
    assert_eq!(budget.left(), 0);
    std::fs::write(folder.join("b"), png(2, 8, 2, &[], &[&[0; 6]])).unwrap();
    let no_room = images.texture(&folder.join("b"), Lookup { color_space: ColorSpace::Srgb, interpolation: Interpolation::Closest, ..Lookup::default() });
    let error = no_room.expect_err("the budget is spent").to_string();
    assert!(error.contains("left; --memory sets the limit"), "{error}");
}

#[test]
fn sixteen_bits_take_two_bytes() {
    let path = directory("sixteen").join("image");
    std::fs::write(&path, png(2, 16, 2, &[], &[&[1; 12]])).unwrap();
    let (texture, _) = load(&path).unwrap();
    assert_eq!(Texture::memory(&[texture]), 12);
}

/// What the fuzzer has found: decoders that panic, the second where overflows are
/// checked, as they are here.
#[test]
fn decoders_that_panic_end_nothing_else() {
    let data = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/fuzz");
    let budget = smithwalk::memory::Budget::new(1 << 30);
    let file = data.join("sample_format.tiff");
    let error = smithwalk::texture::load_environment(&file, &budget).unwrap_err();
    assert!(error.to_string().contains("its decoder gave up"), "{error}");
    let read = smithwalk::image::read_exr(&data.join("b44.exr"));
    assert_eq!(read.is_err(), cfg!(debug_assertions));
}
