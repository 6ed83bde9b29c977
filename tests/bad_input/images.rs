//! Textures and surroundings.

use super::{directory, without};
use smithwalk::memory::Budget;
use smithwalk::texture::{ColorSpace, Interpolation, Lookup, Texture, load_environment};
use std::fmt::Write as _;

/// Encodes a 16 × 16 gradient.
fn encode(format: image::ImageFormat) -> Vec<u8> {
    let picture = image::RgbImage::from_fn(16, 16, |x, y| {
        image::Rgb([(16 * x) as u8, (16 * y) as u8, 7])
    });
    let mut bytes = std::io::Cursor::new(Vec::new());
    match format {
        image::ImageFormat::Hdr => image::DynamicImage::from(picture)
            .to_rgb32f()
            .write_to(&mut bytes, format)
            .unwrap(),
        _ => picture.write_to(&mut bytes, format).unwrap(),
    }
    bytes.into_inner()
}

fn encode_exr() -> Vec<u8> {
    use exr::prelude::*;
    let channels = SpecificChannels::rgb(|at: Vec2<usize>| (at.x() as f32, at.y() as f32, 7.0_f32));
    let mut bytes = std::io::Cursor::new(Vec::new());
    Image::from_channels((16, 16), channels)
        .write()
        .to_buffered(&mut bytes)
        .unwrap();
    bytes.into_inner()
}

/// A small image in every format, with its extension.
fn whole_files() -> [(&'static str, Vec<u8>); 5] {
    use image::ImageFormat::{Hdr, Jpeg, Png, Tiff};
    [
        ("png", encode(Png)),
        ("jpg", encode(Jpeg)),
        ("tif", encode(Tiff)),
        ("hdr", encode(Hdr)),
        ("exr", encode_exr()),
    ]
}

#[test]
fn images() {
    let directory = directory("bad-images");
    let load = |name: &str| {
        Texture::load(
            &directory.join(name),
            Lookup {
                color_space: ColorSpace::Srgb,
                interpolation: Interpolation::Bilinear,
                ..Lookup::default()
            },
        )
        .map(|_| ())
    };
    let mut said = String::new();
    let whole = whole_files();
    for (extension, bytes) in &whole {
        std::fs::write(directory.join(format!("whole.{extension}")), bytes).unwrap();
        assert_eq!(load(&format!("whole.{extension}")), Ok(()), "{extension}");
        for (name, length) in [
            ("header", 12),
            ("half", bytes.len() / 2),
            ("end", bytes.len() - 24),
        ] {
            let name = format!("{name}.{extension}");
            std::fs::write(directory.join(&name), &bytes[..length]).unwrap();
            let answer = match load(&name) {
                Ok(()) => "read as if it were whole".to_owned(),
                Err(error) => without(&error.to_string(), &directory),
            };
            writeln!(said, "# {name}\n{answer}\n").unwrap();
        }
    }
    std::fs::write(directory.join("empty.png"), "").unwrap();
    std::fs::write(directory.join("text.png"), "this is no image").unwrap();
    for name in ["missing.png", "empty.png", "text.png", "."] {
        let error = load(name).expect_err("expected an error");
        writeln!(
            said,
            "# {name}\n{}\n",
            without(&error.to_string(), &directory)
        )
        .unwrap();
    }
    let error = load_environment(&directory.join("whole.png"), &Budget::of_machine())
        .expect_err("expected an error");
    writeln!(
        said,
        "# an environment of 8 bits\n{}\n",
        without(&error.to_string(), &directory)
    )
    .unwrap();
    insta::assert_snapshot!(said);
}

/// Flips bytes of whole images, from a fixed seed: each is read or refused.
#[test]
fn mutated_images_never_panic() {
    let directory = directory("mutated-images");
    let whole = whole_files();
    let mut rng = rand_pcg::Pcg64Mcg::new(11);
    let mut below = |n: usize| (rand::Rng::next_u64(&mut rng) % n as u64) as usize;
    for (extension, bytes) in whole {
        let path = directory.join(format!("image.{extension}"));
        let mut refused = 0;
        for _ in 0..400 {
            let mut bytes = bytes.clone();
            for _ in 0..1 + below(3) {
                // Headers are where most can go wrong.
                let range = if below(2) == 0 {
                    bytes.len().min(400)
                } else {
                    bytes.len()
                };
                bytes[below(range)] = below(256) as u8;
            }
            std::fs::write(&path, &bytes).unwrap();
            let texture = Texture::load(
                &path,
                Lookup {
                    color_space: ColorSpace::Srgb,
                    interpolation: Interpolation::Bilinear,
                    ..Lookup::default()
                },
            );
            match texture {
                Ok((texture, _)) => assert!(
                    texture
                        .sample([0.3, 0.6])
                        .iter()
                        .all(|value| value.is_finite())
                ),
                Err(_) => refused += 1,
            }
        }
        assert!(
            (1..400).contains(&refused),
            "{extension}: {refused} of 400 refused"
        );
    }
}
