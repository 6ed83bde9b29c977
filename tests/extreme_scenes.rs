//! Scenes at the extremes of size, place, brightness and geometry, each held
//! against something else: the same scene at an ordinary scale, the furnace in
//! which everything is 1, darkness, a closed form. None may have a sample that
//! is negative, infinite or not a number ([`common::film`] asserts it).

use crate::common::{Settings, image};
use exr::prelude::write_rgb_file;
use smithwalk::image::Image;
use std::fmt::Write as _;
use std::path::PathBuf;

/// A directory that is empty at the start.
fn directory(name: &str) -> PathBuf {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("extreme_{name}"));
    let _ = std::fs::remove_dir_all(&path);
    std::fs::create_dir_all(&path).unwrap();
    path
}

/// Where the metre and the origin of a scene lie.
#[derive(Clone, Copy)]
struct Place {
    scale: f64,
    offset: f64,
}

const HERE: Place = Place {
    scale: 1.0,
    offset: 0.0,
};

impl Place {
    fn point(self, p: [f64; 3]) -> [f64; 3] {
        p.map(|x| x * self.scale + self.offset)
    }
}

/// A mesh as OBJ text grows.
#[derive(Default)]
struct Obj {
    text: String,
    vertices: usize,
}

impl Obj {
    fn vertex(&mut self, place: Place, p: [f64; 3]) -> usize {
        let [x, y, z] = place.point(p);
        writeln!(self.text, "v {x:.17e} {y:.17e} {z:.17e}").unwrap();
        self.vertices += 1;
        self.vertices
    }

    fn face(&mut self, corners: &[usize]) {
        let corners: Vec<String> = corners.iter().map(usize::to_string).collect();
        writeln!(self.text, "f {}", corners.join(" ")).unwrap();
    }

    fn quad(place: Place, corners: [[f64; 3]; 4]) -> Self {
        let mut obj = Self::default();
        let corners = corners.map(|p| obj.vertex(place, p));
        obj.face(&corners);
        obj
    }

    /// An axis-aligned box; its outside is outside.
    fn cuboid(place: Place, low: [f64; 3], high: [f64; 3]) -> Self {
        let mut obj = Self::default();
        for k in 0..8 {
            let pick = |axis: usize| {
                if k >> axis & 1 == 1 {
                    high[axis]
                } else {
                    low[axis]
                }
            };
            obj.vertex(place, [pick(0), pick(1), pick(2)]);
        }
        for face in [
            [1, 3, 4, 2],
            [5, 6, 8, 7],
            [1, 2, 6, 5],
            [3, 7, 8, 4],
            [1, 5, 7, 3],
            [2, 4, 8, 6],
        ] {
            obj.face(&face);
        }
        obj
    }

    /// A sphere of 24 by 12 quads.
    fn ball(place: Place, center: [f64; 3], radius: f64) -> Self {
        let (rings, sectors) = (12, 24);
        let mut obj = Self::default();
        for i in 0..=rings {
            let (sin, cos) = (std::f64::consts::PI * f64::from(i) / f64::from(rings)).sin_cos();
            for j in 0..sectors {
                let phi = std::f64::consts::TAU * f64::from(j) / f64::from(sectors);
                let p = [sin * phi.cos(), sin * phi.sin(), cos];
                obj.vertex(place, [0, 1, 2].map(|k| center[k] + radius * p[k]));
            }
        }
        let at = |i: i32, j: i32| (i * sectors + j % sectors + 1) as usize;
        for i in 0..rings {
            for j in 0..sectors {
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                if i > 0 {
                    obj.face(&[a, b, d]);
                }
                if i + 1 < rings {
                    obj.face(&[b, c, d]);
                }
            }
        }
        obj
    }
}

/// A scene as it is written down.
struct Draft {
    place: Place,
    eye: [f64; 3],
    target: [f64; 3],
    /// The sections `world`, `materials`, `lights` and `textures`.
    yaml: String,
    objects: Vec<(Obj, &'static str)>,
    max_bounces: u32,
}

impl Draft {
    fn image(&self, name: &str, spp: u32) -> Image {
        let folder = directory(name);
        self.image_in(&folder, spp)
    }

    /// Of plain paths: with branches, a path that rounding has changed would
    /// change its neighbours as well, by what is decided from its noise.
    fn image_in(&self, folder: &std::path::Path, spp: u32) -> Image {
        let list = |p: [f64; 3]| format!("{:?}", self.place.point(p));
        let mut text = format!(
            "smithwalk: 1\ncamera:\n  transform: {{look_at: {{from: {}, to: {}}}}}\n  projection: {{perspective: {{fov: 50}}}}\nfilm: {{width: 32, height: 32}}\nsampling: {{max_bounces: {}, branches: 1}}\n{}\nmeshes:\n",
            list(self.eye),
            list(self.target),
            self.max_bounces,
            self.yaml
        );
        for (k, (obj, _)) in self.objects.iter().enumerate() {
            std::fs::write(folder.join(format!("{k}.obj")), &obj.text).unwrap();
            writeln!(text, "  m{k}: {{file: {k}.obj}}").unwrap();
        }
        text += "objects:\n";
        for (k, (_, material)) in self.objects.iter().enumerate() {
            writeln!(text, "  - {{mesh: m{k}, material: {material}}}").unwrap();
        }
        let path = folder.join("scene.yaml");
        std::fs::write(&path, text).unwrap();
        image(&path, &[], Settings::spp(spp), &[])
    }
}

/// A room corner with a glass block, a rough metal ball and an area light:
/// every kind of scattering. All lengths and places are sums of 64ths, which
/// `f32` can hold 10⁵ metres away.
fn still_life(place: Place, brightness: f64) -> Draft {
    let [x, y, z] = place.point([1.0, -1.0, 3.0]);
    let at = format!("[[1, 0, 0, {x:?}], [0, 1, 0, {y:?}], [0, 0, 1, {z:?}], [0, 0, 0, 1]]");
    let size = place.scale;
    // P = L π A
    let power = 40.0 * brightness * size * size;
    Draft {
        place,
        eye: [-2.0, -5.0, 2.0],
        target: [0.0, 0.0, 0.5],
        yaml: format!(
            "world: {{constant: {{strength: {:?}}}}}
materials:
  floor: {{diffuse: {{color: 0.5}}}}
  gold: {{conductor: {{alpha: 0.4, color: [1, 0.7, 0.3]}}}}
  glass: {{dielectric: {{alpha: 0.1}}}}
  brushed: {{conductor: {{alpha_x: 0.3, alpha_y: 0.01, color: 0.8, tangent: {{radial: z}}}}}}
lights:
  - {{area: {{power: {power:?}, shape: {{rectangle: {{width: {size:?}, height: {size:?}}}}}, transform: {{matrix: {at}}}}}}}",
            0.2 * brightness
        ),
        objects: vec![
            (Obj::quad(place, [[-4.0, -4.0, 0.0], [4.0, -4.0, 0.0], [4.0, 4.0, 0.0], [-4.0, 4.0, 0.0]]), "floor"),
            (Obj::cuboid(place, [-1.5, -1.5, 0.0], [-0.5, -0.5, 1.0]), "glass"),
            (Obj::cuboid(place, [0.25, -1.0, 0.0], [1.25, 0.0, 1.0]), "gold"),
            (Obj::cuboid(place, [-0.5, 0.5, 0.0], [0.5, 1.5, 1.5]), "brushed"),
        ],
        max_bounces: 12,
    }
}

/// Two images of the same scene with the same random numbers: the share of
/// values that differ by more than 1 %, the relative difference of the means,
/// and that over its standard error. Few paths take another way, so the
/// difference has little noise of its own.
#[derive(Debug)]
struct Comparison {
    differ: f64,
    bias: f64,
    score: f64,
}

impl Comparison {
    fn new(a: &Image, b: &Image, factor: f64) -> Self {
        let pairs: Vec<(f64, f64)> = a
            .color
            .iter()
            .zip(&b.color)
            // The sum of channels: those of a pixel are not independent.
            .map(|(a, b)| {
                let sum = |c: &[f32; 3]| c.iter().map(|&c| f64::from(c)).sum::<f64>();
                (sum(a), sum(b) / factor)
            })
            .collect();
        let same = pairs
            .iter()
            .filter(|(a, b)| (a - b).abs() <= 0.01 * a.max(*b))
            .count();
        let (sum, difference, squares) = pairs.iter().fold((0.0, 0.0, 0.0), |(s, d, q), (a, b)| {
            (s + a, d + (b - a), q + (b - a).powi(2))
        });
        Self {
            differ: 1.0 - same as f64 / pairs.len() as f64,
            bias: difference / sum,
            score: difference / f64::sqrt(squares).max(f64::MIN_POSITIVE),
        }
    }

    /// Not more than `differ` of the pixels are others, and their mean is
    /// within `bias`, a relative difference, or four standard errors: a false
    /// alarm in 16 000 choices of seeds.
    fn expect(&self, what: &str, differ: f64, bias: f64) {
        println!("{what}: {self:?}");
        let same = self.bias.abs() <= bias || self.score.abs() < 4.0;
        assert!(self.differ <= differ && same, "{what}: {self:?}");
    }
}

/// Rounding decides differently in few paths only, so most pixels stay as they
/// are and the mean hardly moves; were surfaces to shadow themselves, or light
/// to leak, neither would.
#[test]
fn size_and_brightness_change_no_image() {
    let reference = still_life(HERE, 1.0).image("unit", 32);
    for scale in [1e-4, 1e6] {
        let place = Place { scale, ..HERE };
        let image = still_life(place, 1.0).image("size", 32);
        Comparison::new(&reference, &image, 1.0).expect(&format!("size {scale:e}"), 0.15, 1e-3);
    }
    for brightness in [1e-20, 1e20] {
        let image = still_life(HERE, brightness).image("brightness", 32);
        Comparison::new(&reference, &image, brightness).expect(
            &format!("brightness {brightness:e}"),
            0.01,
            1e-4,
        );
    }
}

/// 10⁵ metres away `f32` steps by 8 mm.
#[test]
fn a_scene_far_from_the_origin_is_the_same() {
    let reference = still_life(HERE, 1.0).image("near", 32);
    let place = Place {
        offset: 1e5,
        ..HERE
    };
    let image = still_life(place, 1.0).image("far", 32);
    Comparison::new(&reference, &image, 1.0).expect("10⁵ m away", 0.15, 1e-3);
}

/// A closed room of any size and in any place, lit from outside alone: not one
/// sample finds a crack.
#[test]
fn closed_rooms_are_dark() {
    for (what, scale, offset) in [
        ("unit", 1.0, 0.0),
        ("tiny", 1e-4, 0.0),
        ("vast", 1e6, 0.0),
        ("far", 1.0, 1e5),
    ] {
        let place = Place { scale, offset };
        let draft = Draft {
            place,
            eye: [-1.5, -1.75, 0.25],
            target: [1.0, 1.5, 1.0],
            yaml: "world: {constant: {strength: 1e6}}\nmaterials:\n  wall: {diffuse: {color: 0.9}}\n  metal: {conductor: {alpha: 0.5}}".into(),
            objects: vec![
                (Obj::cuboid(place, [-2.0, -2.0, 0.0], [2.0, 2.0, 2.0]), "wall"),
                (Obj::cuboid(place, [-0.5, -0.5, 0.0], [0.5, 0.5, 1.0]), "metal"),
            ],
            max_bounces: 12,
        };
        let image = draft.image(&format!("room_{what}"), 64);
        let leaks = image
            .color
            .iter()
            .filter(|c| c.iter().any(|&c| c != 0.0))
            .count();
        assert_eq!(leaks, 0, "{what}: {leaks} pixels see light from outside");
    }
}

/// What stands in a furnace: surfaces that absorb nothing, or as much as they
/// emit, in a world of radiance 1. Then every path brings 1, and roulette or
/// the end of a path are all that can change it.
fn furnace(name: &str, place: Place, eye: [f64; 3], objects: Vec<(Obj, &'static str)>) {
    let draft = Draft {
        place,
        eye,
        target: [0.0, 0.0, 0.0],
        yaml: "world: {constant: {strength: 1}}
materials:
  white: {diffuse: {color: 1}}
  mirror: {conductor: {alpha: 0, color: 1}}
  silver: {conductor: {alpha: 0.5, color: 1}}
  plaster: {rough_diffuse: {alpha: 1, color: 1}}
  glass: {dielectric: {alpha: 0, ior: 1.5}}
  water: {dielectric: {alpha: 0, ior: 1.33}}
  frosted: {dielectric: {alpha: 0.3, ior: 1.5}}
  lamp: {emission: {strength: 1}}"
            .into(),
        objects,
        max_bounces: 2000,
    };
    let image = draft.image(&format!("furnace_{name}"), 16);
    let values: Vec<f64> = image.color.iter().map(|c| f64::from(c[0])).collect();
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    let error = (squares / (n * (n - 1.0))).sqrt();
    println!("{name}: {mean} ± {error}");
    // Ten furnaces at 4 standard errors: a false alarm in 1600 runs of seeds.
    assert!(
        (mean - 1.0).abs() < (4.0 * error).max(1e-3),
        "{name}: {mean} ± {error}"
    );
}

const OUTSIDE: [f64; 3] = [0.5, -3.0, 1.0];

#[test]
fn glass_in_glass_is_a_furnace() {
    let ball = |r| Obj::ball(HERE, [0.0; 3], r);
    furnace(
        "nested",
        HERE,
        OUTSIDE,
        vec![
            (ball(1.0), "glass"),
            (ball(0.7), "water"),
            (ball(0.4), "frosted"),
        ],
    );
    furnace(
        "light inside glass",
        HERE,
        OUTSIDE,
        vec![(ball(1.0), "glass"), (ball(0.5), "lamp")],
    );
    furnace(
        "light inside frosted glass",
        HERE,
        OUTSIDE,
        vec![(ball(1.0), "frosted"), (ball(0.5), "lamp")],
    );
    furnace(
        "camera inside glass",
        HERE,
        [0.1, -0.2, 0.3],
        vec![(ball(1.0), "frosted")],
    );
    furnace(
        "camera inside a wall",
        HERE,
        [0.1, -0.2, 0.3],
        vec![(ball(1.0), "lamp")],
    );
    for (what, place) in [
        (
            "tiny glass",
            Place {
                scale: 1e-4,
                ..HERE
            },
        ),
        ("vast glass", Place { scale: 1e6, ..HERE }),
    ] {
        let ball = |r| Obj::ball(place, [0.0; 3], r);
        furnace(
            what,
            place,
            OUTSIDE,
            vec![(ball(1.0), "frosted"), (ball(0.5), "silver")],
        );
    }
}

/// Two surfaces in one place, of any two materials that absorb nothing.
#[test]
fn coincident_surfaces_are_a_furnace() {
    let ball = || Obj::ball(HERE, [0.0; 3], 1.0);
    for (a, b) in [
        ("white", "silver"),
        ("glass", "glass"),
        ("plaster", "mirror"),
    ] {
        furnace(
            &format!("{a} on {b}"),
            HERE,
            OUTSIDE,
            vec![(ball(), a), (ball(), b)],
        );
    }
}

/// A floor of needles a million times as long as wide, and of triangles without
/// area, is a floor.
#[test]
fn needles_make_a_floor() {
    let place = HERE;
    let reference = still_life(place, 1.0).image("floor", 16);
    let mut draft = still_life(place, 1.0);
    let mut obj = Obj::default();
    // From −4 to 4, mostly in a few wide strips with needles between them.
    let mut edges: Vec<f64> = (0..=16).map(|k| -4.0 + 0.5 * f64::from(k)).collect();
    edges.extend((0..16).map(|k| -4.0 + 0.5 * f64::from(k) + 7.6e-6));
    edges.sort_by(f64::total_cmp);
    let rows: Vec<[usize; 2]> = edges
        .iter()
        .map(|&x| [-4.0, 4.0].map(|y| obj.vertex(place, [x, y, 0.0])))
        .collect();
    for pair in rows.windows(2) {
        let ([a, d], [b, c]) = (pair[0], pair[1]);
        obj.face(&[a, b, c]);
        obj.face(&[a, c, d]);
        obj.face(&[a, a, c]);
        obj.face(&[a, b, a]);
    }
    draft.objects[0].0 = obj;
    let image = draft.image("needles", 16);
    Comparison::new(&reference, &image, 1.0).expect("needles", 0.15, 1e-3);
}

/// One texel of 10⁶ in a black sky over a white floor: the irradiance is the
/// integral of the texel's bilinear tent.
#[test]
fn one_bright_texel_lights_a_floor() {
    let folder = directory("texel");
    let (width, height, at) = (64usize, 32usize, (20usize, 9usize));
    write_rgb_file(folder.join("sky.exr"), width, height, |x, y| {
        let c = if (x, y) == at { 1e6f32 } else { 0.0 };
        (c, c, c)
    })
    .unwrap();
    let draft = Draft {
        place: HERE,
        eye: [0.0, -1.0, 3.0],
        target: [0.0, 0.0, 0.0],
        yaml: "world: {environment: {file: sky.exr}}\nmaterials:\n  white: {diffuse: {color: 1}}"
            .into(),
        objects: vec![(
            Obj::quad(
                HERE,
                [
                    [-9.0, -9.0, 0.0],
                    [9.0, -9.0, 0.0],
                    [9.0, 9.0, 0.0],
                    [-9.0, 9.0, 0.0],
                ],
            ),
            "white",
        )],
        max_bounces: 2,
    };
    let image = draft.image_in(&folder, 64);
    // Elevation falls with the row; the tent is two texels wide and high.
    let step = std::f64::consts::PI / height as f64;
    let n = 1000;
    let rows = (0..n).map(|k| 2.0 * (f64::from(k) + 0.5) / f64::from(n) - 1.0);
    let irradiance: f64 = rows
        .map(|v| {
            let elevation = std::f64::consts::FRAC_PI_2 - (at.1 as f64 + 0.5 + v) * step;
            (1.0 - v.abs()) * elevation.sin() * elevation.cos()
        })
        .sum::<f64>()
        * (2.0 / f64::from(n))
        * step
        * (std::f64::consts::TAU / width as f64)
        * 1e6;
    let expected = irradiance / std::f64::consts::PI;
    let n = image.color.len() as f64;
    let mean = image.color.iter().map(|c| f64::from(c[0])).sum::<f64>() / n;
    println!("one texel: {mean} against {expected}");
    assert!(
        (mean / expected - 1.0).abs() < 5e-3,
        "{mean} against {expected}"
    );
}

/// Texels that are no numbers, infinite or out of any range are taken for 0,
/// and said to be.
#[test]
fn textures_with_nan_are_mended_and_told() {
    let picture = |name: &str, broken: [f32; 3]| {
        let folder = directory(name);
        write_rgb_file(folder.join("t.exr"), 8, 8, |x, y| match (x + y) % 4 {
            0 => (broken[0], 0.5, 0.5),
            1 => (0.2, broken[1], 0.9),
            2 => (0.4, 0.4, broken[2]),
            _ => (0.1, 0.6, 0.3),
        })
        .unwrap();
        let mut floor = Obj::quad(
            HERE,
            [
                [-4.0, -4.0, 0.0],
                [4.0, -4.0, 0.0],
                [4.0, 4.0, 0.0],
                [-4.0, 4.0, 0.0],
            ],
        );
        floor.text = floor.text.replace(
            "f 1 2 3 4",
            "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4",
        );
        let mut draft = still_life(HERE, 1.0);
        draft.objects[0] = (floor, "tiled");
        draft.yaml = draft.yaml.replace(
            "materials:",
            "textures: {t: {file: t.exr, color_space: linear}}\nmaterials:\n  tiled: {conductor: {color: {texture: t}, alpha: {texture: t}}}",
        );
        let image = draft.image_in(&folder, 16);
        let description =
            smithwalk::description::Description::load(&folder.join("scene.yaml"), &[]).unwrap();
        (
            image,
            smithwalk::scene::resolve(&description).unwrap().repairs,
        )
    };
    let (broken, told) = picture("nan", [f32::NAN, f32::INFINITY, f32::NEG_INFINITY]);
    let (whole, nothing) = picture("zero", [0.0; 3]);
    assert!(broken.color == whole.color);
    assert!(nothing.is_empty(), "{nothing:?}");
    assert!(
        told.iter().any(|t| t.contains("`t`") && t.contains("48")),
        "{told:?}"
    );
}
