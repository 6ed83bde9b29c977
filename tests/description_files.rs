//! What mesh and image files become.

use proptest::prelude::*;
use smithwalk::description::Channel;
use smithwalk::memory::Budget;
use smithwalk::mesh::{Mesh, Repair, Wanted};
use smithwalk::texture::{
    self, ColorSpace, Interpolation, Lookup, Texture, UvTransform, load_environment,
};
use std::path::PathBuf;

fn read(text: &str) -> (Mesh, Vec<Repair>) {
    read_only(text, Wanted::ALL)
}

fn read_only(text: &str, wanted: Wanted) -> (Mesh, Vec<Repair>) {
    Mesh::read(std::io::Cursor::new(text.as_bytes()), "mesh.obj", wanted)
        .unwrap_or_else(|error| panic!("{error}"))
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

#[test]
fn a_mesh_holds_what_its_file_says() {
    let (mesh, repairs) = read(&format!(
        "# a comment\nmtllib nowhere.mtl\no square\n{SQUARE}vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 2\ns 1\n\
         usemtl dark wood\nf 1/1/1 2/2/1 3/3/1 # half\nusemtl gold\nf 1/1/1 3/3/1 4/4/1\nusemtl dark wood\nf 1/1/1 2/2/1 4/4/1\n"
    ));
    assert_eq!(repairs, []);
    assert_eq!(mesh.triangles.len(), 3);
    assert_eq!(mesh.material_names, ["dark wood", "gold"]);
    assert_eq!(mesh.material_of_triangle, Some(vec![0, 1, 0]));
    let normals = mesh.normals.expect("normals");
    let uvs = mesh.uvs.expect("texture coordinates");
    assert_eq!(
        (normals.len(), uvs.len()),
        (mesh.positions.len(), mesh.positions.len())
    );
    assert!(
        normals.iter().all(|normal| *normal == [0.0, 0.0, 1.0]),
        "{normals:?}"
    );
    for (position, uv) in mesh.positions.iter().zip(&uvs) {
        assert_eq!(position[..2], uv[..]);
    }
    let corners: Vec<[f32; 3]> = mesh.triangles[1]
        .map(|index| mesh.positions[index as usize])
        .to_vec();
    assert_eq!(corners, [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]);
    assert!(mesh.positions.capacity() > mesh.positions.len());
}

/// More than the parser is given as one object, and than it is given at once.
const MANY: usize = 100_000;

#[test]
fn a_mesh_of_many_faces_is_one_mesh_in_the_order_of_its_file() {
    use std::fmt::Write;
    let (mut vertices, mut faces) = (String::new(), String::new());
    for i in 0..MANY {
        writeln!(vertices, "v {i} {} 0\nvn 0 0 {}", i % 2, i + 1).unwrap();
        if i > 2 {
            // Vertices far apart, so that some are yet to come everywhere.
            let far = (i * 7919) % MANY + 1;
            let (a, b) = (i - 1, i);
            let corner = |v: usize| format!("{v}//{v}");
            let third = if far == a || far == b { i + 1 } else { far };
            writeln!(faces, "f {} {} {}", corner(a), corner(b), corner(third)).unwrap();
        }
    }
    let read = |text: String| {
        let (mesh, repairs) = read(&text);
        let corners: Vec<[[f32; 3]; 3]> = mesh
            .triangles
            .iter()
            .map(|triangle| triangle.map(|index| mesh.positions[index as usize]))
            .collect();
        (corners, mesh.normals, repairs)
    };
    let (after, normals, repairs) = read(format!("{vertices}{faces}"));
    let (before, ..) = read(format!("{faces}{vertices}"));
    assert_eq!(repairs, []);
    assert_eq!(after.len(), MANY - 3);
    assert!(after == before, "the order of vertices and faces matters");
    assert_eq!(after[0][0], [1.0, 1.0, 0.0]);
    assert_eq!(after[MANY - 4][0], [(MANY - 3) as f32, 1.0, 0.0]);
    assert!(normals.is_some());
}

#[test]
fn the_line_of_a_mistake_is_known_far_into_a_file_and_on_one_thread() {
    let text = format!("{}v 1 1.2.3 0\n{SQUARE}", "v 1 2 3\n".repeat(MANY));
    let error = || {
        Mesh::read(
            std::io::Cursor::new(text.as_bytes()),
            "mesh.obj",
            Wanted::ALL,
        )
        .expect_err("1.2.3")
    };
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1);
    let alone = one_thread.build().unwrap().install(error);
    assert_eq!(
        alone.to_string(),
        format!(
            "mesh.obj:{}: position parse error in `v 1 1.2.3 0`",
            MANY + 1
        )
    );
    assert_eq!(error(), alone);
}

#[test]
fn what_is_not_there_takes_no_memory() {
    let (mesh, _) = read(&format!("{SQUARE}f 1 2 3 4\n"));
    assert_eq!((mesh.positions.len(), mesh.triangles.len()), (4, 2));
    assert_eq!(
        (mesh.normals, mesh.uvs, mesh.material_of_triangle),
        (None, None, None)
    );
    assert_eq!(mesh.material_names, Vec::<String>::new());

    let one_material = read(&format!("{SQUARE}usemtl a\nf 1 2 3\nusemtl a\nf 1 3 4\n")).0;
    assert_eq!(
        (
            one_material.material_of_triangle,
            one_material.material_names
        ),
        (None, vec!["a".to_owned()])
    );
    let some = read(&format!("{SQUARE}f 1 2 3\nusemtl a\nf 1 3 4\n")).0;
    assert_eq!(some.material_names, ["a", ""]);
    assert_eq!(some.material_of_triangle, Some(vec![1, 0]));

    let all = format!(
        "{SQUARE}vt 0 0\nvt 1 1\nvn 0 0 1\nvn 0 1 0\nf 1/1/1 2/2/1 3/1/2 4/2/2\nf 1/2/2 2/1/2 3/2/1\n"
    );
    let (bare, _) = read_only(
        &all,
        Wanted {
            uvs: false,
            normals: false,
            colors: false,
        },
    );
    assert_eq!(
        (bare.positions.len(), bare.normals, bare.uvs),
        (4, None, None)
    );
    let (with_uvs, _) = read_only(
        &all,
        Wanted {
            uvs: true,
            normals: false,
            colors: false,
        },
    );
    assert_eq!((with_uvs.positions.len(), with_uvs.normals), (7, None));
    assert_eq!(with_uvs.uvs.map(|uvs| uvs.len()), Some(7));
}

#[test]
fn files_may_be_written_in_many_ways() {
    let plain = read(&format!("{SQUARE}f 1 2 3\nf 1 3 4\n")).0;
    let same = [
        (
            "CRLF",
            format!("{SQUARE}f 1 2 3\nf 1 3 4\n").replace('\n', "\r\n"),
        ),
        (
            "relative indices",
            format!("{SQUARE}f -4 -3 -2\nf -4 -2 -1\n"),
        ),
        (
            "a byte order mark and tabs",
            format!("\u{feff}{SQUARE}f\t1 2\t3\n  f 1 3 4  "),
        ),
        (
            "continued lines",
            format!("{SQUARE}f 1 \\\n2 3\nf 1 3\\\r\n 4"),
        ),
        ("groups", format!("{SQUARE}g\nf 1 2 3\nf 1 3 4\n")),
        (
            "colours of vertices",
            format!(
                "{}f 1 2 3\nf 1 3 4\n",
                SQUARE.replace("0\n", "0 0.5 0.5 0.5\n")
            ),
        ),
        (
            "weights",
            "v 0 0 0 2\nv 2 0 0 2\nv 2 2 0 2\nv 0 2 0 2\nf 1 2 3\nf 1 3 4\n".to_owned(),
        ),
        (
            "positions after the faces",
            format!("f 1 2 3\nf 1 3 4\n{SQUARE}"),
        ),
    ];
    for (what, text) in same {
        assert_eq!(read(&text).0, plain, "{what}");
    }
    let grouped = read(&format!("o a\n{SQUARE}f 1 2 3\ng b\nf 1 3 4\n")).0;
    assert_eq!((grouped.positions.len(), grouped.triangles.len()), (6, 2));
}

#[test]
fn repairs_are_made_and_counted() {
    let (mesh, repairs) = read(&format!(
        "{SQUARE}v 0.5 1.5 0\nf 1 2 3 5 4\nl 1 2\np 1\nf 1 2\nf 1 2 2\n"
    ));
    assert_eq!(mesh.triangles.len(), 3);
    let expected = [
        Repair::PolygonsTriangulated(1),
        Repair::PointsAndLinesIgnored(3),
        Repair::DegenerateTrianglesDropped(1),
    ];
    assert_eq!(repairs, expected);

    // One corner of two triangles has no usable normal: each gets its own.
    let text = format!(
        "{SQUARE}v 0 0 1\nvn 0 0 0\nvn 0 0 3\nvn nan 0 0\nf 1//1 2//2 3//2\nf 1//1 4//2 5//3\n"
    );
    let (mesh, repairs) = read(&text);
    assert_eq!(repairs, [Repair::NormalsReplaced(3)]);
    let normals = mesh.normals.as_ref().expect("normals");
    let of = |triangle: usize| mesh.triangles[triangle].map(|index| normals[index as usize]);
    assert_eq!(of(0), [[0.0, 0.0, 1.0]; 3]);
    assert_eq!(of(1), [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]);

    // Some corners have a normal, some texture coordinates.
    let (mesh, repairs) = read(&format!(
        "{SQUARE}vn 0 1 0\nvt 1 1\nf 1/1/1 2 3\ng other\nf 1/1/1 3/1/1 4/1/1\n"
    ));
    assert_eq!(
        repairs,
        [
            Repair::NormalsIncomplete(1),
            Repair::NormalsReplaced(3),
            Repair::UvsReplaced(3)
        ]
    );
    let normals = mesh.normals.as_ref().expect("normals");
    assert_eq!(
        mesh.triangles[0].map(|index| normals[index as usize]),
        [[0.0, 0.0, 1.0]; 3]
    );
    assert_eq!(
        mesh.triangles[1].map(|index| normals[index as usize]),
        [[0.0, 1.0, 0.0]; 3]
    );
}

#[test]
fn a_polygon_may_have_a_million_corners() {
    let count = 1_000_000;
    let mut text = String::new();
    for i in 0..count {
        let angle = std::f64::consts::TAU * f64::from(i) / f64::from(count);
        text += &format!("v {:.7} {:.7} 0\n", 1e3 * angle.cos(), 1e3 * angle.sin());
    }
    text += "f";
    for i in 1..=count {
        text += &format!(" {i}");
    }
    let (mesh, repairs) = read(&text);
    assert_eq!(repairs[0], Repair::PolygonsTriangulated(1));
    let dropped = repairs.iter().find_map(|repair| match repair {
        Repair::DegenerateTrianglesDropped(count) => Some(*count),
        _ => None,
    });
    assert_eq!(
        mesh.triangles.len() + dropped.unwrap_or(0),
        count as usize - 2
    );
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 3000,
        failure_persistence: None,
        rng_seed: proptest::test_runner::RngSeed::Fixed(2),
        ..ProptestConfig::default()
    })]

    /// Whatever becomes of a mesh file, what is read can be rendered.
    #[test]
    fn mutated_meshes_are_sound_or_refused(
        edits in prop::collection::vec((0..200_usize, 0..6_usize, "[0-9a-z/ .\\-\n\\\\]{0,5}"), 1..6),
        uvs: bool,
        normals: bool,
    ) {
        let mut text: Vec<char> =
            format!("{SQUARE}vt 0 0\nvt 1 1\nvn 0 0 1\nvn 1 0 0\nusemtl a\nf 1/1/1 2/2/1 3/1/2 4/2/2\ng b\nusemtl b\nf -1/1 -2/1 1/1\nl 1 2\n")
                .chars()
                .collect();
        for (start, length, replacement) in edits {
            let start = start.min(text.len());
            let end = (start + length).min(text.len());
            text.splice(start..end, replacement.chars());
        }
        let text: String = text.into_iter().collect();
        match Mesh::read(std::io::Cursor::new(text.as_bytes()), "mesh.obj", Wanted { uvs, normals, colors: false }) {
            Ok((mesh, _)) => {
                let count = mesh.positions.len();
                prop_assert!(mesh.positions.iter().flatten().all(|x| x.is_finite()));
                prop_assert!(mesh.triangles.iter().flatten().all(|&index| (index as usize) < count));
                if let Some(normals) = &mesh.normals {
                    prop_assert_eq!(normals.len(), count);
                    for &index in mesh.triangles.iter().flatten() {
                        let length = normals[index as usize].iter().map(|x| x * x).sum::<f32>().sqrt();
                        prop_assert!((length - 1.0).abs() < 1e-5, "a normal of length {length}");
                    }
                }
                if let Some(uvs) = &mesh.uvs {
                    prop_assert_eq!(uvs.len(), count);
                    prop_assert!(uvs.iter().flatten().all(|x| x.is_finite()));
                }
                if let Some(materials) = &mesh.material_of_triangle {
                    prop_assert_eq!(materials.len(), mesh.triangles.len());
                    prop_assert!(materials.iter().all(|&id| usize::from(id) < mesh.material_names.len()));
                }
            }
            Err(error) => prop_assert!(!error.problems.is_empty()),
        }
    }
}

fn directory() -> PathBuf {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("description-files");
    std::fs::create_dir_all(&path).unwrap();
    path
}

/// Three by two pixels, from the upper left one on.
const PIXELS: [[u8; 3]; 6] = [
    [255, 0, 0],
    [0, 255, 128],
    [10, 20, 40],
    [200, 180, 60],
    [90, 0, 255],
    [255, 255, 255],
];

fn load(name: &str, color_space: ColorSpace, interpolation: Interpolation) -> Texture {
    let (texture, repairs) = Texture::load(
        &directory().join(name),
        Lookup {
            color_space,
            interpolation,
            ..Lookup::default()
        },
    )
    .unwrap();
    assert_eq!(repairs, []);
    texture
}

/// What Cycles (Blender 3.4.1) gives for the six pixels: an emissive face per
/// place, all of whose corners have these texture coordinates, seen by an
/// orthographic camera.
#[test]
fn textures_are_looked_up_as_cycles_does() {
    let image = image::RgbImage::from_raw(3, 2, PIXELS.concat()).unwrap();
    image.save(directory().join("cycles.png")).unwrap();
    type Row = ([f32; 2], [f32; 3]);
    let srgb: [Row; 8] = [
        ([0.1, 0.2], [0.64794, 0.43361, 0.10201]),
        ([0.5, 0.5], [0.02624, 0.21404, 0.52405]),
        ([0.02, 0.97], [0.46253, 0.12384, 0.06849]),
        ([0.99, 0.03], [0.47578, 0.21486, 0.1296]),
        ([1.3, -0.4], [0.32268, 0.13787, 0.07468]),
        ([-2.7, 3.9], [0.32268, 0.13787, 0.07468]),
        ([0.333, 0.75], [0.21497, 0.21312, 0.05107]),
        ([0.25, 0.6], [0.48881, 0.09112, 0.03824]),
    ];
    let plain: [Row; 4] = [
        ([0.1, 0.2], [0.82549, 0.6898, 0.35255]),
        ([0.02, 0.97], [0.71012, 0.38685, 0.29023]),
        ([-2.7, 3.9], [0.60353, 0.40706, 0.3029]),
        ([0.25, 0.6], [0.72794, 0.33382, 0.21578]),
    ];
    let closest: [Row; 6] = [
        ([0.1, 0.2], [0.57758, 0.45641, 0.04519]),
        ([0.5, 0.5], [0.0, 1.0, 0.21586]),
        ([0.02, 0.97], [1.0, 0.0, 0.0]),
        ([0.99, 0.03], [1.0, 1.0, 1.0]),
        ([-2.7, 3.9], [1.0, 0.0, 0.0]),
        ([0.333, 0.75], [1.0, 0.0, 0.0]),
    ];
    let cases: [(&[Row], ColorSpace, Interpolation); 3] = [
        (&srgb, ColorSpace::Srgb, Interpolation::Bilinear),
        (&plain, ColorSpace::NonColor, Interpolation::Bilinear),
        (&closest, ColorSpace::Srgb, Interpolation::Closest),
    ];
    for (rows, color_space, interpolation) in cases {
        let texture = load("cycles.png", color_space, interpolation);
        for (uv, expected) in rows {
            let [r, g, b, a] = texture.sample(*uv);
            for (found, expected) in [r, g, b].into_iter().zip(expected) {
                // The table has five decimals, of Cycles' single precision.
                assert!(
                    (found - expected).abs() < 3e-5,
                    "{color_space:?} {uv:?}: {found} instead of {expected}"
                );
            }
            assert_eq!(a, 1.0);
        }
    }
}

#[test]
fn every_format_keeps_its_values() {
    use exr::prelude::{Image, SpecificChannels, Vec2, WritableImage};
    let directory = directory();
    let bytes = image::RgbImage::from_raw(3, 2, PIXELS.concat()).unwrap();
    let floats = image::DynamicImage::from(bytes.clone()).into_rgb32f();
    bytes.save(directory.join("formats.png")).unwrap();
    bytes.save(directory.join("formats.tif")).unwrap();
    floats.save(directory.join("formats.hdr")).unwrap();
    image::DynamicImage::from(bytes.clone())
        .into_rgb16()
        .save(directory.join("formats16.png"))
        .unwrap();
    let channels = SpecificChannels::rgb(|at: Vec2<usize>| {
        let [r, g, b] = floats.get_pixel(at.x() as u32, at.y() as u32).0;
        (r, g, b)
    });
    Image::from_channels((3, 2), channels)
        .write()
        .to_file(directory.join("formats.exr"))
        .unwrap();
    // HDR has a common exponent and eight bits of mantissa.
    let formats = [
        ("formats.png", 1e-6),
        ("formats.tif", 1e-6),
        ("formats16.png", 1e-6),
        ("formats.exr", 1e-6),
        ("formats.hdr", 4e-3),
    ];
    for (name, tolerance) in formats {
        let texture = load(name, ColorSpace::NonColor, Interpolation::Closest);
        assert_eq!(texture.size(), [3, 2], "{name}");
        for (index, pixel) in PIXELS.iter().enumerate() {
            let uv = [
                (index % 3) as f32 / 3.0 + 0.1,
                0.75 - 0.5 * (index / 3) as f32,
            ];
            let found = texture.sample(uv);
            for (found, expected) in found.iter().zip(pixel) {
                assert!(
                    (found - f32::from(*expected) / 255.0).abs() <= tolerance,
                    "{name} {index}: {found}"
                );
            }
        }
    }
}

#[test]
fn channels_scale_and_offset() {
    let image = image::RgbaImage::from_raw(2, 1, vec![51, 102, 204, 153, 0, 0, 0, 255]).unwrap();
    let path = directory().join("channels.png");
    image.save(&path).unwrap();
    let texture = load("channels.png", ColorSpace::Linear, Interpolation::Closest);
    let at = |channel| texture.channel([0.25, 0.5], channel);
    let expected = [
        0.2,
        0.4,
        0.8,
        0.6,
        0.2126 * 0.2 + 0.7152 * 0.4 + 0.0722 * 0.8,
    ];
    let found = [
        at(Channel::R),
        at(Channel::G),
        at(Channel::B),
        at(Channel::A),
        at(Channel::Luminance),
    ];
    for (found, expected) in found.into_iter().zip(expected) {
        assert!(
            (found - expected).abs() < 1e-6,
            "{found} instead of {expected}"
        );
    }
    let (moved, _) = Texture::load(
        &path,
        Lookup {
            color_space: ColorSpace::Linear,
            interpolation: Interpolation::Closest,
            transform: UvTransform::from_parts([0.5, 1.0], 0.0, [0.5, 0.0]),
            ..Lookup::default()
        },
    )
    .unwrap();
    assert_eq!(moved.sample([0.0, 0.5]), texture.sample([0.5, 0.5]));
    assert_eq!(moved.sample([1.5, 0.5]), texture.sample([1.25, 0.5]));
    for uv in [
        [f32::MAX, -f32::MAX],
        [f32::INFINITY, f32::NAN],
        [-1e-30, 1.0],
    ] {
        assert!(
            texture.sample(uv).iter().all(|value| value.is_finite()),
            "{uv:?}"
        );
    }
    let smooth = load("channels.png", ColorSpace::Srgb, Interpolation::Bilinear);
    for uv in [
        [f32::MAX, -f32::MAX],
        [f32::INFINITY, f32::NAN],
        [-1e-30, 1.0],
    ] {
        assert!(
            smooth.sample(uv).iter().all(|value| value.is_finite()),
            "{uv:?}"
        );
    }
}

#[test]
fn environments_are_mended_and_counted() {
    use exr::prelude::{Image, SpecificChannels, Vec2, WritableImage};
    let path = directory().join("sky.exr");
    let channels = SpecificChannels::rgb(|at: Vec2<usize>| match (at.x(), at.y()) {
        (0, 0) => (f32::NAN, 1.0, f32::INFINITY),
        (1, 0) => (-1.0, 2.0, 3.0),
        (0, 1) => (0.0, 1.0, 1e30),
        (x, y) => (x as f32, y as f32, 1e4),
    });
    Image::from_channels((2, 2), channels)
        .write()
        .to_file(&path)
        .unwrap();
    let (sky, repairs) = load_environment(&path, &Budget::of_machine()).unwrap();
    assert_eq!((sky.width, sky.height), (2, 2));
    assert_eq!(
        sky.pixels,
        [
            [0.0, 1.0, 0.0],
            [0.0, 2.0, 3.0],
            [0.0, 1.0, 0.0],
            [1.0, 1.0, 1e4]
        ]
    );
    assert_eq!(
        repairs,
        [texture::Repair::OutOfRange(3), texture::Repair::Negative(1)]
    );
}
