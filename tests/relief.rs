//! Normals out of textures of normals and of heights.

use std::path::PathBuf;

use crate::common::folder;
use glam::{Mat3, Vec3};
use smithwalk::description::Description;
use smithwalk::embree::Ray;
use smithwalk::features::Features;
use smithwalk::scene::{Scene, Surface, View, resolve};

/// Files of a test.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        Self(folder(&format!("relief-{name}")))
    }

    fn write(&self, name: &str, text: &str) {
        std::fs::write(self.0.join(name), text).unwrap();
    }

    /// An image of one colour.
    fn color(&self, name: &str, color: [u8; 3]) {
        let image = image::RgbImage::from_pixel(4, 4, image::Rgb(color));
        image.save(self.0.join(name)).unwrap();
    }

    fn describe(&self, text: &str) -> Description {
        self.write("scene.yaml", text);
        Description::load(&self.0.join("scene.yaml"), &[]).unwrap_or_else(|e| panic!("{e}"))
    }

    fn scene(&self, text: &str) -> Scene {
        let resolved = resolve(&self.describe(text)).unwrap_or_else(|e| panic!("{e}"));
        resolved.scene
    }
}

const STORED: [u8; 3] = [204, 102, 230];

fn stored() -> Vec3 {
    Vec3::from(STORED.map(|c| f32::from(c) / 255.0 * 2.0 - 1.0))
}

/// Where the z axis meets the scene, from above or from below, and who looks.
fn look(scene: &Scene, from_above: bool) -> (Surface, View) {
    let down = if from_above { -1.0 } else { 1.0 };
    let ray = Ray::new(Vec3::new(0.0, 0.0, -down * 9.0), Vec3::new(0.0, 0.0, down));
    let hit = scene
        .accelerator
        .intersect(ray)
        .expect("something is there");
    let mut surface = scene.surface::<{ Features::EVERYTHING.bits() }>(&ray, &hit);
    surface.footprint = 0.01;
    let view = View {
        wo: -ray.direction,
        camera: true,
    };
    (surface, view)
}

/// The shading normal there.
fn normal(scene: &Scene, from_above: bool) -> Vec3 {
    let (surface, view) = look(scene, from_above);
    scene.normal(&surface, view)
}

/// A square whose texture coordinates are mirrored or not, on an object that is turned
/// and stretched, alone or instanced, mirrored or not, smooth or flat, from both sides:
/// the map's normal is where ∂p/∂u, ∂p/∂v and the normal of the object's own space put
/// it, and then goes as normals do.
#[test]
fn tangent_space_follows_texture_object_and_side() {
    let folder = Folder::new("tangent");
    folder.color("n.png", STORED);
    for bits in 0..32 {
        let [texture, object, smooth, shared, above] = [1, 2, 4, 8, 16].map(|bit| bits & bit != 0);
        let sign = if texture { -1.0 } else { 1.0 };
        // u runs along y, v along −x, or along x where the texture is mirrored.
        let uv = |x: f32, y: f32| format!("vt {y} {}\n", -x * sign);
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let mut obj: String = corners
            .iter()
            .map(|(x, y)| format!("v {x} {y} 0\n"))
            .collect();
        obj.extend(corners.iter().map(|(x, y)| uv(*x, *y)));
        obj.push_str(if smooth {
            "vn 0 0 1\nf 1/1/1 2/2/1 3/3/1 4/4/1\n"
        } else {
            "f 1/1 2/2 3/3 4/4\n"
        });
        folder.write("quad.obj", &obj);
        let x = if object { -2.0 } else { 2.0 };
        let placed = format!("scale: [{x}, 1, 0.5], rotation: [0, 0, 30]");
        let other = if shared {
            "\n  - {mesh: quad, material: m, transform: {location: [90, 0, 0]}}"
        } else {
            ""
        };
        let scene = folder.scene(&format!(
            "smithwalk: 1\n\
             textures: {{n: {{file: n.png}}}}\n\
             materials: {{m: {{conductor: {{alpha: 0.2, normal: {{texture: n}}}}}}}}\n\
             meshes: {{quad: {{file: quad.obj}}}}\n\
             objects:\n  - {{mesh: quad, material: m, transform: {{{placed}}}}}{other}\n"
        ));
        let n = stored();
        let local = Vec3::Y * n.x - Vec3::X * (sign * n.y) + Vec3::Z * n.z;
        let to_world =
            Mat3::from_rotation_z(30f32.to_radians()) * Mat3::from_diagonal(Vec3::new(x, 1.0, 0.5));
        let expected = (to_world.inverse().transpose() * local).normalize();
        let expected = if above { expected } else { -expected };
        let found = normal(&scene, above);
        assert!(
            (found - expected).length() < 1e-5,
            "{bits:05b}: {found}, expected {expected}"
        );
    }
}

#[test]
fn object_and_world_space_and_strength_are_those_of_cycles() {
    let folder = Folder::new("spaces");
    folder.color("n.png", STORED);
    folder.write(
        "quad.obj",
        "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n",
    );
    let at = |keys: &str, above| {
        let scene = folder.scene(&format!(
            "smithwalk: 1\n\
             textures: {{n: {{file: n.png}}}}\n\
             materials: {{m: {{mix: {{factor: 0.5, a: {{diffuse: {{normal: {{texture: n, {keys}}}}}}}, \
             b: {{principled: {{version: 4.5, normal: {{texture: n, {keys}}}}}}}}}}}}}\n\
             meshes: {{quad: {{file: quad.obj}}}}\n\
             objects: [{{mesh: quad, material: m, transform: {{rotation: [0, 0, 90]}}}}]\n"
        ));
        normal(&scene, above)
    };
    let n = stored();
    let turned = Vec3::new(-n.y, n.x, n.z);
    let close = |a: Vec3, b: Vec3| assert!((a - b.normalize()).length() < 1e-5, "{a} {b}");
    close(at("space: world", true), n);
    close(at("space: world", false), -n);
    close(at("space: object", true), turned);
    close(at("space: tangent", true), turned);
    close(at("strength: 0", true), Vec3::Z);
    close(at("strength: 0.5", true), Vec3::Z + turned.normalize());
    close(at("strength: 2", true), turned.normalize() * 2.0 - Vec3::Z);
}

/// Where the file says it, and which mesh lacks them.
#[test]
fn missing_texture_coordinates_are_told() {
    let folder = Folder::new("missing");
    folder.color("n.png", STORED);
    folder.write("bare.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    let description = folder.describe(
        "smithwalk: 1\n\
         textures: {n: {file: n.png}}\n\
         materials:\n  \
           m: {mix: {a: {diffuse: {}}, b: {conductor: {normal: {texture: n}}}}}\n\
         meshes: {bare: {file: bare.obj}}\n\
         objects: [{name: Ball, mesh: bare, material: m}]\n",
    );
    let error = resolve(&description)
        .expect_err("no coordinates")
        .to_string();
    let expected = "scene.yaml:4:55: materials.m.mix.b.conductor.normal: \
                    this needs texture coordinates, which the mesh `bare` of Ball lacks";
    assert!(error.ends_with(expected), "{error}");
}

/// Every mistake in a normal map is told at its place.
#[test]
fn mistakes_are_told_at_their_place() {
    for (keys, expected) in [
        ("texture: nn", "there is no texture `nn`; did you mean `n`?"),
        (
            "texture: n, strength: -1",
            "expected a number, 0 or more, found -1",
        ),
        (
            "texture: n, space: local",
            "expected `tangent`, `object` or `world`, found `local`",
        ),
        ("strength: 1", "the key `texture` is missing"),
    ] {
        let text = format!(
            "smithwalk: 1\ntextures: {{n: {{file: n.png}}}}\n\
             materials: {{m: {{diffuse: {{normal: {{{keys}}}}}}}}}\n"
        );
        let error = Description::from_str(&text, "scene", &[]).expect_err(keys);
        let error = error.to_string();
        assert!(
            error.contains("scene:3:") && error.contains(expected),
            "{keys}: {error}"
        );
    }
    let text = "smithwalk: 1\nmaterials: {m: {transparent: {normal: {texture: n}}}}\n";
    let error = Description::from_str(text, "scene", &[]).expect_err("no normal to replace");
    assert!(
        error.to_string().contains("unknown key `normal`"),
        "{error}"
    );
}

const QUAD: &str = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
                    f 1/1 2/2 3/3 4/4\n";

/// Heights that rise by 1 over the 2 m of the square: slopes of one half times the
/// distance, on both sides towards the viewer.
#[test]
fn bump_leans_by_the_slope_of_heights() {
    let folder = Folder::new("bump");
    folder.write("quad.obj", QUAD);
    let heights = |x: u32, _: u32| image::Luma([(f64::from(x) + 0.5) / 256.0 * 65535.0]);
    let heights = image::ImageBuffer::from_fn(256, 1, |x, y| {
        let image::Luma([height]) = heights(x, y);
        image::Luma([height.round() as u16])
    });
    heights.save(folder.0.join("h.png")).unwrap();
    folder.color("n.png", STORED);
    let at = |keys: &str, above| {
        let scene = folder.scene(&format!(
            "smithwalk: 1\n\
             textures: {{h: {{file: h.png}}, n: {{file: n.png}}}}\n\
             materials: {{m: {{conductor: {{{keys}}}}}}}\n\
             meshes: {{quad: {{file: quad.obj}}}}\n\
             objects: [{{mesh: quad, material: m, transform: {{rotation: [0, 0, 90]}}}}]\n"
        ));
        normal(&scene, above)
    };
    let close = |a: Vec3, b: Vec3| assert!((a - b.normalize()).length() < 2e-3, "{a} {b}");
    // The square is turned: u runs along y.
    let leant = Vec3::new(0.0, -0.2, 1.0);
    close(at("bump: {texture: h, distance: 0.4}", true), leant);
    let below = Vec3::new(0.0, -0.2, -1.0);
    close(at("bump: {texture: h, distance: 0.4}", false), below);
    let deep = Vec3::new(0.0, 0.2, 1.0);
    close(
        at("bump: {texture: h, distance: 0.4, invert: true}", true),
        deep,
    );
    let half = leant.normalize() + Vec3::Z;
    close(
        at("bump: {texture: h, distance: 0.4, strength: 0.5}", true),
        half,
    );
    let wide = "bump: {texture: h, distance: 0.4, filter_width: 4, channel: r}";
    close(at(wide, true), leant);
    // On top of a normal map: along the surface that this gives.
    let n = stored();
    let mapped = Vec3::new(-n.y, n.x, n.z).normalize();
    // The heights rise along y alone.
    let turn = Vec3::X.dot(Vec3::Y.cross(mapped));
    let both = mapped * turn - mapped.cross(Vec3::X) * 0.2;
    let found = at(
        "normal: {texture: n}, bump: {texture: h, distance: 0.4}",
        true,
    );
    close(found, both);
}

#[test]
fn mistakes_in_heights_are_told_at_their_place() {
    for (keys, expected) in [
        ("texture: hh", "there is no texture `hh`; did you mean `h`?"),
        (
            "texture: h, distance: -1",
            "expected a number, 0 or more, found -1",
        ),
        (
            "texture: h, filter_width: 0",
            "expected a number above 0 and up to 16, found 0",
        ),
        ("texture: h, depth: 1", "unknown key `depth`"),
    ] {
        let text = format!(
            "smithwalk: 1\ntextures: {{h: {{file: h.png}}}}\n\
             materials: {{m: {{diffuse: {{bump: {{{keys}}}}}}}}}\n"
        );
        let error = Description::from_str(&text, "scene", &[]).expect_err(keys);
        let error = error.to_string();
        assert!(
            error.contains("scene:3:") && error.contains(expected),
            "{keys}: {error}"
        );
    }
}
