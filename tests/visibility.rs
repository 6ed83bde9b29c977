//! What rays of some kinds pass, told by images of scenes without it.

use std::path::PathBuf;

use crate::common::{Settings, image};
use smithwalk::description::Description;
use smithwalk::film::Aov;
use smithwalk::image::{Display, Image, OutputPath};

const FLOOR: &str = "v -4 -4 0\nv 4 -4 0\nv 4 4 0\nv -4 4 0\nf 1 2 3 4\n";
/// Above the floor, between it and the sun, and in part before the camera.
const ROOF: &str = "v -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\nf 1 2 3 4\n";

/// A floor of the given material under a sun, a lamp and a world, with a roof over it.
/// `roof`, `lamp` and `world` are further keys of each; without a roof there is none.
fn render(name: &str, floor: &str, roof: Option<&str>, lamp: &str, world: &str) -> Image {
    image(
        &scene(name, floor, roof, lamp, world),
        &[],
        Settings::spp(16),
        &[],
    )
}

/// The scene's file.
fn scene(name: &str, floor: &str, roof: Option<&str>, lamp: &str, world: &str) -> PathBuf {
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
    path
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
/// without power; other floors take it as before, bit for bit.
#[test]
fn lamps_light_the_kinds_that_see_them() {
    let floor = |name: &str, floor: &str, keys: &str, power: &str| {
        let path = scene(name, floor, None, keys, "");
        let changes = [
            ("lights.0.sun.strength", "0"),
            ("lights.1.area.power", power),
        ];
        image(&path, &changes, Settings::spp(16), &[]).color
    };
    for (kind, of_kind, others) in [
        ("diffuse", DIFFUSE, [METAL, GLASS]),
        ("glossy", METAL, [DIFFUSE, DIFFUSE]),
    ] {
        let hidden = format!(", hidden_from: [{kind}]");
        let lit = floor("lit", of_kind, "", "30");
        let unlit = floor("unlit", of_kind, "", "0");
        assert!(lit != unlit, "{kind}");
        assert!(
            floor("hidden_lamp", of_kind, &hidden, "30") == unlit,
            "{kind}"
        );
        for other in others {
            let seen = floor("other", other, &hidden, "30");
            assert!(seen == floor("other", other, "", "30"), "{kind}");
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

/// The image of the scene with a roof, with changes.
fn changed(name: &str, roof: &str, changes: &[(&str, &str)]) -> Image {
    let path = scene(name, DIFFUSE, Some(roof), "", "");
    let description = Description::load(&path, &owned(changes)).unwrap();
    let aovs: Vec<Aov> = description
        .film
        .transparent
        .then_some(Aov::Alpha)
        .into_iter()
        .collect();
    image(&path, changes, Settings::spp(16), &aovs)
}

fn owned(changes: &[(&str, &str)]) -> Vec<(String, String)> {
    let owned = |&(key, value): &(&str, &str)| (key.to_owned(), value.to_owned());
    changes.iter().map(owned).collect()
}

/// On a transparent film there is nothing for the world, with an alpha of 0; surfaces are
/// as on any film, bit for bit, with an alpha of 1; a holdout is nothing too.
#[test]
fn transparent_films_have_an_alpha() {
    const TRANSPARENT: (&str, &str) = ("film.transparent", "true");
    let opaque = changed("opaque", "", &[]);
    let transparent = changed("transparent", "", &[TRANSPARENT]);
    let alpha = transparent.alpha().unwrap();
    assert!(opaque.alpha().is_none());
    let mut counts = [0; 3];
    for ((&alpha, &color), &before) in alpha.iter().zip(&transparent.color).zip(&opaque.color) {
        match alpha {
            0.0 => assert_eq!(color, [0.0; 3]),
            1.0 => assert_eq!(color, before),
            _ => assert!(0.0 < alpha && alpha < 1.0 && color < before, "{alpha}"),
        }
        counts[if alpha == 0.0 {
            0
        } else {
            1 + usize::from(alpha == 1.0)
        }] += 1;
    }
    assert!(counts.iter().all(|&count| count > 10), "{counts:?}");

    let hole = changed("hole", ", holdout: true", &[TRANSPARENT]);
    let holes = hole.alpha().unwrap().iter().zip(alpha);
    let cut = holes
        .filter(|&(&hole, &whole)| hole == 0.0 && whole == 1.0)
        .count();
    assert!(cut > 10, "{cut} pixels");
    let black = changed("black", ", holdout: true", &[]);
    let same = black
        .color
        .iter()
        .zip(&opaque.color)
        .filter(|(a, b)| a == b)
        .count();
    assert!(black.color.iter().filter(|&&c| c == [0.0; 3]).count() >= cut && same > 10);

    let png = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("transparent.png");
    let output = OutputPath::new(&png).unwrap();
    output.write(&transparent, &Display::default()).unwrap();
    let bytes = std::fs::read(&png).unwrap();
    assert_eq!(bytes[25], 6, "the PNG's colour type is RGBA");
}

#[test]
fn cameras_see_between_their_planes_and_gain_is_a_factor() {
    let whole = changed("whole", "", &[]);
    let wide = changed("wide", "", &[("camera.clip", "[0, 1e6]")]);
    assert!(wide.color == whole.color);
    for clip in ["[0, 0.5]", "[100, 200]"] {
        let beyond = changed("beyond", "", &[("camera.clip", clip)]);
        // Of the suns and lamps none is visible to the camera.
        assert!(beyond.color.iter().all(|&c| c == [0.2, 0.3, 0.4]), "{clip}");
    }
    let some = changed("some", "", &[("camera.clip", "[0, 8]")]);
    let cut = some
        .color
        .iter()
        .zip(&whole.color)
        .filter(|(a, b)| a != b)
        .count();
    assert!((10..some.color.len() - 10).contains(&cut), "{cut} pixels");
    let twice = changed("twice", "", &[("film.gain", "2")]);
    let doubled: Vec<_> = whole.color.iter().map(|c| c.map(|c| 2.0 * c)).collect();
    assert!(twice.color == doubled);
}
