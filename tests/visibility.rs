//! What rays of some kinds pass, told by images of scenes without it.

use std::path::PathBuf;

use crate::common::{Settings, image};
use smithwalk::image::Image;

const FLOOR: &str = "v -4 -4 0\nv 4 -4 0\nv 4 4 0\nv -4 4 0\nf 1 2 3 4\n";
/// Above the floor, between it and the sun, and in part before the camera.
const ROOF: &str = "v -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\nf 1 2 3 4\n";

/// A floor of the given material under a sun, a lamp and a world, with a roof over it.
/// `roof`, `lamp` and `world` are further keys of each; without a roof there is none.
fn render(name: &str, floor: &str, roof: Option<&str>, lamp: &str, world: &str) -> Image {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("visibility_{name}"));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("floor.obj"), FLOOR).unwrap();
    std::fs::write(folder.join("roof.obj"), ROOF).unwrap();
    let roof = roof.map_or(String::new(), |keys| {
        format!("  - {{mesh: roof, material: white{keys}}}\n")
    });
    let scene = format!(
        "smithwalk: 1
camera:
  transform: {{look_at: {{from: [0, -6, 5], to: [0, 0, 0]}}}}
  projection: {{perspective: {{fov: 50}}}}
film: {{width: 24, height: 16}}
sampling: {{max_bounces: 3, branches: 1}}
world: {{constant: {{color: [0.2, 0.3, 0.4]{world}}}}}
materials:
  white: {{diffuse: {{color: 0.8}}}}
  floor: {floor}
meshes: {{floor: {{file: floor.obj}}, roof: {{file: roof.obj}}}}
objects:
  - {{mesh: floor, material: floor}}
{roof}lights:
  - sun: {{strength: 2}}
  - area: {{power: 30, shape: {{rectangle: {{width: 1, height: 1}}}}, transform: {{location: [1, 0, 3]}}{lamp}}}
"
    );
    let path = folder.join("scene.yaml");
    std::fs::write(&path, scene).unwrap();
    image(&path, &[], Settings::spp(16), &[])
}

const DIFFUSE: &str = "{diffuse: {color: 0.5}}";
const METAL: &str = "{conductor: {roughness: 0.4, color: 0.9}}";
const GLASS: &str = "{dielectric: {roughness: 0.3}}";

/// What is hidden from every ray leaves the image as it is without it, bit for bit; what
/// only shadow rays pass throws no shadow and is seen.
#[test]
fn what_no_ray_meets_is_not_there() {
    let with = |name, roof| render(name, DIFFUSE, roof, "", "");
    let without = with("no_roof", None);
    let hidden = ", visible_to_camera: false, hidden_from: [diffuse, glossy, transmission, shadow]";
    assert!(with("hidden", Some(hidden)).color == without.color);
    assert!(with("seen", Some("")).color != without.color);
    // The floor right under the roof is in the sun again; the roof is seen above it.
    let shadowless = with("shadow", Some(", hidden_from: [shadow, diffuse]"));
    let changed = (0..without.color.len()).filter(|&i| shadowless.color[i] != without.color[i]);
    let shadowed = with("shadowed", Some(", visible_to_camera: false"));
    let darker =
        (0..without.color.len()).filter(|&i| shadowed.color[i][0] < 0.9 * without.color[i][0]);
    assert!(changed.clone().count() > 10 && darker.clone().count() > 10);
    let roof: Vec<usize> = changed.collect();
    assert!(
        darker.clone().any(|i| !roof.contains(&i)),
        "the shadow lies beside the roof"
    );
}

/// A lamp that is hidden from the kind of scattering of the floor gives it as much as one
/// that is not there; other floors take it as before, bit for bit.
#[test]
fn lamps_light_the_kinds_that_see_them() {
    let floor = |name: &str, floor: &str, lamp: &str| render(name, floor, None, lamp, "");
    let dark = ", exposure: -32";
    for (kind, of_kind, others) in [
        ("diffuse", DIFFUSE, [METAL, GLASS]),
        ("glossy", METAL, [DIFFUSE, DIFFUSE]),
    ] {
        let hidden = format!(", hidden_from: [{kind}]");
        let unlit = floor("unlit", of_kind, dark);
        let without = floor("without", of_kind, &hidden);
        let mean = |image: &Image| image.color.iter().map(|c| c[1]).sum::<f32>();
        // The kind that sees it not: light samples of it are lost, others as they were.
        assert!((mean(&without) / mean(&unlit) - 1.0).abs() < 0.02, "{kind}");
        assert!(mean(&floor("lit", of_kind, "")) > 1.2 * mean(&unlit));
        for other in others {
            assert!(
                floor("as", other, &hidden).color == floor("is", other, "").color,
                "{kind}"
            );
        }
    }
}

/// A world that the camera does not see is black behind the floor and shines on it.
#[test]
fn worlds_are_black_for_rays_that_they_are_hidden_from() {
    let world = |name: &str, hidden: &str| {
        let keys = format!(", hidden_from: [{hidden}]");
        render(name, DIFFUSE, None, ", exposure: -32", &keys)
    };
    let (seen, unseen) = (world("world", ""), world("unseen", "camera"));
    let beyond = seen.color.iter().zip(&unseen.color).filter(|(a, b)| a != b);
    assert!(beyond.clone().count() > 10);
    assert!(beyond.clone().any(|(_, &unseen)| unseen == [0.0; 3]));
    let dim = world("dim", "diffuse");
    let brighter = |image: &Image| image.color.iter().filter(|c| c[2] > 1.2 * c[0]).count();
    assert!(
        brighter(&dim) < brighter(&seen),
        "the floor is no longer lit by the blue world"
    );
}
