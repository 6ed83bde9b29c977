//! What scene files mean.

use proptest::prelude::*;
use smithwalk::description::{
    Aperture, AreaShape, Assignment, Axis, Channel, Color, Description, Estimator, Factor, Film,
    Filter, LightKind, LightUnits, Material, MaterialRef, Opening, Placing, Projection,
    Reflectance, Roughness, Sampling, Scalar, Scattering, SensorFit, Tangent, Transform, World,
};
use smithwalk::film::Aov;
use smithwalk::texture::{ColorSpace, Interpolation};

fn read(text: &str) -> Description {
    Description::from_str(text, "scene.yaml", &[]).unwrap_or_else(|problems| panic!("{problems}"))
}

/// The example of the documentation.
fn example() -> &'static str {
    let page = include_str!("../docs/scene-format.md");
    page.split("```yaml\n")
        .nth(1)
        .and_then(|rest| rest.split("```").next())
        .expect("the page has an example")
}

fn material(text: &str) -> Material {
    Material::from_yaml(text).unwrap_or_else(|problems| panic!("{problems}"))
}

fn roughness_of(text: &str) -> Roughness {
    match material(text) {
        Material::Conductor(conductor) => conductor.rough.roughness,
        other => panic!("expected a conductor, found {other:?}"),
    }
}

#[test]
fn the_documented_example_says_what_it_seems_to() {
    let scene = read(example());
    assert_eq!(scene.light_units, LightUnits::Cycles4);
    let camera = scene.camera.expect("a camera");
    assert_eq!(
        camera.transform,
        Transform::LookAt {
            from: [0.0, -6.0, 2.5],
            to: [0.0, 0.0, 0.9],
            up: [0.0, 0.0, 1.0]
        }
    );
    let Projection::Perspective(perspective) = camera.projection else {
        panic!("expected a perspective")
    };
    assert_eq!(perspective.opening, Opening::Fov(35.0));
    let lens = camera.depth_of_field.expect("a lens");
    assert_eq!(
        (lens.aperture, lens.focus_distance),
        (Aperture::FStop(2.8), 6.0)
    );
    assert_eq!(
        scene.world,
        Some(World::Constant {
            hidden_from: Vec::new(),
            color: [0.5, 0.6, 0.8],
            strength: 0.5
        })
    );
    let Material::Conductor(gold) = &scene.materials["gold"] else {
        panic!("expected a conductor")
    };
    assert_eq!(
        gold.reflectance,
        Reflectance::Color(Color::Value([1.0, 0.71, 0.29]))
    );
    let Material::Diffuse(ground) = &scene.materials["ground"] else {
        panic!("expected a diffuse material")
    };
    assert_eq!(ground.color, Color::Value([0.5; 3]));
    assert_eq!(scene.objects[0].materials, Assignment::All("gold".into()));
    let Assignment::BySlot(slots) = &scene.objects[1].materials else {
        panic!("expected slots")
    };
    assert_eq!(
        (slots["slot_a"].as_str(), slots["slot_b"].as_str()),
        ("ground", "gold")
    );
    assert_eq!(scene.lights[0].name.as_deref(), Some("Key"));
    let shape = AreaShape::Rectangle {
        width: 1.5,
        height: 1.0,
    };
    assert_eq!(
        scene.lights[0].kind,
        LightKind::Area {
            power: 200.0,
            shape,
            spread: 180.0
        }
    );
}

#[test]
fn what_is_left_out_has_the_documented_default() {
    let shown = read(example());
    let bare = read("smithwalk: 1");
    assert_eq!(bare.film, shown.film);
    assert_eq!(
        bare.film,
        Film {
            gain: 1.0,
            transparent: false,
            width: 256,
            height: 256,
            filter: Filter::Box {},
            exposure: 0.0,
            view: None,
            aovs: vec![]
        }
    );
    assert_eq!(bare.sampling, shown.sampling);
    let auto = Estimator::Auto;
    assert_eq!(
        bare.sampling,
        Sampling {
            spp: 64,
            seed: 0,
            max_bounces: 12,
            roulette_start: None,
            branches: None,
            estimator: auto
        }
    );
    assert_eq!(bare.light_units, shown.light_units);
    assert_eq!((bare.camera, bare.world), (None, None));

    let text = "smithwalk: 1\ntextures: {t: {file: t.png}}";
    assert_eq!(
        read(text).textures["t"].image().unwrap().color_space,
        shown.textures["scratches"].image().unwrap().color_space
    );
    assert_eq!(
        read(text).textures["t"].image().unwrap().interpolation,
        shown.textures["scratches"].image().unwrap().interpolation
    );
    let placing = Placing::Parts {
        scale: [1.0; 2],
        rotation: 0.0,
        offset: [0.0; 2],
    };
    assert_eq!(read(text).textures["t"].image().unwrap().placing, placing);

    let scene = read(
        "smithwalk: 1\nlights: [point: {power: 1}, spot: {power: 2}, sun: {strength: 3}]\n\
         camera: {projection: {orthographic: {}}}",
    );
    assert_eq!(
        scene.lights[0].kind,
        LightKind::Point {
            power: 1.0,
            radius: 0.0,
            soft_falloff: true
        }
    );
    assert_eq!(
        scene.lights[1].kind,
        LightKind::Spot {
            power: 2.0,
            size: 45.0,
            blend: 0.15,
            radius: 0.0
        }
    );
    assert_eq!(
        scene.lights[2].kind,
        LightKind::Sun {
            strength: 3.0,
            angle: 0.0
        }
    );
    assert_eq!(
        (scene.lights[0].color, scene.lights[0].exposure),
        ([1.0; 3], 0.0)
    );
    assert!(!scene.lights[0].visible_to_camera);
    let Projection::Orthographic(view) = scene.camera.expect("a camera").projection else {
        panic!()
    };
    assert_eq!(
        (view.scale, view.sensor_fit, view.shift_x, view.shift_y),
        (6.0, SensorFit::Auto, 0.0, 0.0)
    );
    let scene = read("smithwalk: 1\ncamera: {projection: {perspective: {}}}");
    let Projection::Perspective(view) = scene.camera.expect("a camera").projection else {
        panic!()
    };
    assert_eq!(
        (view.opening, view.sensor_width, view.sensor_height),
        (Opening::Lens(50.0), 36.0, 24.0)
    );
    assert_eq!(view.pixel_aspect, 1.0);
}

#[test]
fn roughness_keeps_the_way_it_was_given() {
    let value = Scalar::Value;
    assert_eq!(
        roughness_of("conductor: {alpha: 0.5}"),
        Roughness::Alpha(value(0.5))
    );
    let both = Roughness::AlphaXy {
        x: value(0.5),
        y: value(0.25),
    };
    assert_eq!(
        roughness_of("conductor: {alpha_x: 0.5, alpha_y: 0.25}"),
        both
    );
    let blender = |roughness, anisotropy| Roughness::Blender {
        roughness: value(roughness),
        anisotropy: value(anisotropy),
    };
    assert_eq!(
        roughness_of("conductor: {roughness: 0.5, anisotropy: -0.25}"),
        blender(0.5, -0.25)
    );
    assert_eq!(roughness_of("conductor: {}"), blender(0.5, 0.0));
    assert_eq!(
        roughness_of("conductor: {anisotropy: 0.5}"),
        blender(0.5, 0.5)
    );
}

#[test]
fn materials_take_every_documented_key() {
    let Material::Conductor(metal) = material(
        "conductor: {distribution: beckmann, scattering: single, alpha: 0, rotation: 0.25, tangent: {radial: z}, metal: gold}",
    ) else {
        panic!("expected a conductor")
    };
    assert_eq!(metal.rough.scattering, Scattering::Single);
    assert_eq!(metal.rough.rotation, Scalar::Value(0.25));
    assert_eq!(metal.rough.tangent, Tangent::Radial(Axis::Z));
    assert!(matches!(metal.reflectance, Reflectance::Metal(_)));
    let reflectance = |text: &str| match material(text) {
        Material::Conductor(conductor) => conductor.reflectance,
        other => panic!("expected a conductor, found {other:?}"),
    };
    let complex = Reflectance::Complex {
        eta: Color::Value([0.2, 0.9, 1.1]),
        k: Color::Value([3.9; 3]),
    };
    assert_eq!(
        reflectance("conductor: {eta: [0.2, 0.9, 1.1], k: 3.9}"),
        complex
    );
    assert_eq!(
        reflectance("conductor: {f0: 0.5}"),
        Reflectance::Schlick {
            f0: Color::Value([0.5; 3])
        }
    );
    assert_eq!(
        reflectance("conductor: {f0: 0.5, f82: [1, 0, 1]}"),
        Reflectance::F82 {
            f0: Color::Value([0.5; 3]),
            f82: Color::Value([1.0, 0.0, 1.0])
        }
    );
    assert_eq!(
        reflectance("conductor: {}"),
        Reflectance::Color(Color::WHITE)
    );

    let Material::Mix(mix) =
        material("mix: {a: {diffuse: {}}, b: {mix: {a: {emission: {}}, b: {transparent: {}}}}}")
    else {
        panic!("expected a mix")
    };
    assert_eq!(mix.factor, Factor::Share(Scalar::Value(0.5)));
    assert!(matches!(&mix.a, MaterialRef::Inline(a) if matches!(**a, Material::Diffuse(_))));
    assert!(matches!(&mix.b, MaterialRef::Inline(b) if matches!(**b, Material::Mix(_))));

    let scene = read(
        "smithwalk: 1\ntextures: {t: {file: t.png, color_space: srgb, interpolation: closest}}\n\
         materials:\n  m: {dielectric: {roughness: {texture: t, channel: g}, ior: 0.75, color: {texture: t}}}",
    );
    assert_eq!(
        scene.textures["t"].image().unwrap().color_space,
        ColorSpace::Srgb
    );
    assert_eq!(
        scene.textures["t"].image().unwrap().interpolation,
        Interpolation::Closest
    );
    let Material::Dielectric(glass) = &scene.materials["m"] else {
        panic!("expected a dielectric")
    };
    let green = Scalar::Texture {
        name: "t".into(),
        channel: Channel::G,
    };
    assert_eq!(
        glass.rough.roughness,
        Roughness::Blender {
            roughness: green,
            anisotropy: Scalar::Value(0.0)
        }
    );
    assert_eq!(
        (&glass.ior, &glass.color),
        (&Scalar::Value(0.75), &Color::Texture("t".into()))
    );
}

#[test]
fn film_and_sampling_take_every_documented_key() {
    let scene = read(
        "smithwalk: 1\nlight_units: cycles_3\nfilm: {filter: {blackman_harris: {}}, aovs: [albedo, variance, multiple]}\n\
         sampling: {estimator: position-free, seed: 18446744073709551615}\n\
         world: {environment: {file: sky.exr, rotation: [0, 0, 90]}}",
    );
    assert_eq!(scene.light_units, LightUnits::Cycles3);
    assert_eq!(scene.film.filter, Filter::BlackmanHarris { width: 1.5 });
    assert_eq!(scene.film.aovs, [Aov::Albedo, Aov::Variance, Aov::Multiple]);
    assert_eq!(
        (scene.sampling.estimator, scene.sampling.seed),
        (Estimator::PositionFree, u64::MAX)
    );
    assert!(matches!(
        scene.world,
        Some(World::Environment {
            strength: 1.0,
            rotation: [0.0, 0.0, 90.0],
            ..
        })
    ));
}

#[test]
fn aliases_stand_for_what_they_name() {
    let scene = read(
        "smithwalk: 1\nmaterials: {a: &shared {diffuse: {color: 0.25}}, b: *shared}\nmeshes: {}\nobjects: []",
    );
    assert_eq!(scene.materials["a"], scene.materials["b"]);
}

#[test]
fn overrides_replace_and_add_values() {
    let set = |pairs: &[(&str, &str)]| {
        let pairs: Vec<_> = pairs
            .iter()
            .map(|(path, value)| (path.to_string(), value.to_string()))
            .collect();
        Description::from_str(example(), "scene.yaml", &pairs)
            .unwrap_or_else(|problems| panic!("{problems}"))
    };
    let scene = set(&[
        ("materials.gold.conductor.roughness", "0.3"),
        ("objects.0.transform.location.2", "4"),
        ("film.filter", "{blackman_harris: {width: 3}}"),
        ("world.constant.strength", "2"),
        ("objects.1.transform.scale", "2"),
        ("objects.0.name", "'1'"),
    ]);
    let Material::Conductor(gold) = &scene.materials["gold"] else {
        panic!("expected a conductor")
    };
    let expected = Roughness::Blender {
        roughness: Scalar::Value(0.3),
        anisotropy: Scalar::Value(0.0),
    };
    assert_eq!(gold.rough.roughness, expected);
    let Transform::Parts { location, .. } = scene.objects[0].transform else {
        panic!("expected parts")
    };
    assert_eq!(location, [0.0, 0.0, 4.0]);
    let Transform::Parts { scale, .. } = scene.objects[1].transform else {
        panic!("expected parts")
    };
    assert_eq!(scale, [2.0; 3]);
    assert_eq!(scene.film.filter, Filter::BlackmanHarris { width: 3.0 });
    assert_eq!(scene.objects[0].name.as_deref(), Some("1"));

    let dotted = "smithwalk: 1\nmaterials: {Gold.001: {diffuse: {color: 0}}}";
    let pair = (
        "materials.Gold.001.diffuse.color".to_owned(),
        "1".to_owned(),
    );
    let scene = Description::from_str(dotted, "scene.yaml", &[pair]).expect("names may hold dots");
    assert!(
        matches!(&scene.materials["Gold.001"], Material::Diffuse(diffuse) if diffuse.color == Color::WHITE)
    );
}

#[test]
fn paths_start_from_the_scene_file() {
    let directory = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("description");
    std::fs::create_dir_all(&directory).unwrap();
    let path = directory.join("scene.yaml");
    std::fs::write(&path, "smithwalk: 1\nmeshes: {a: {file: sub/a.obj}}").unwrap();
    let scene = Description::load(&path, &[]).unwrap();
    assert_eq!(
        scene.resolve_path(&scene.meshes["a"].file),
        directory.join("sub/a.obj")
    );
}

#[test]
fn the_scenes_of_the_repository_are_sound() {
    let scenes = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let files = std::fs::read_dir(&scenes).unwrap().flat_map(|entry| {
        let path = entry.unwrap().path();
        std::fs::read_dir(path)
            .into_iter()
            .flatten()
            .map(|entry| entry.unwrap().path())
    });
    let mut count = 0;
    for path in files.filter(|path| {
        path.extension()
            .is_some_and(|extension| extension == "yaml")
    }) {
        let scene = Description::load(&path, &[]).unwrap_or_else(|problems| panic!("{problems}"));
        for mesh in scene.meshes.values() {
            let file = scene.resolve_path(&mesh.file);
            smithwalk::mesh::Mesh::load(&file, smithwalk::mesh::Wanted::ALL)
                .unwrap_or_else(|error| panic!("{error}"));
        }
        count += 1;
    }
    assert!(count > 0, "no scenes in {}", scenes.display());
}

/// What mutations put in place of something else.
const FRAGMENTS: [&str; 18] = [
    "",
    "{",
    "}",
    "[",
    "]",
    ":",
    "- ",
    "\n",
    "\t",
    "&a ",
    "*a",
    "!!str ",
    "'",
    "\"",
    "1e999",
    "-1",
    ".nan",
    "é\u{feff}\0",
];

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, rng_seed: proptest::test_runner::RngSeed::Fixed(1), ..ProptestConfig::default() })]

    /// Whatever becomes of a scene file, reading it ends in a description or
    /// in problems whose places are inside the file.
    #[test]
    fn mutated_scenes_never_panic(edits in prop::collection::vec((0..2000_usize, 0..12_usize, 0..FRAGMENTS.len()), 1..6)) {
        let mut text: Vec<char> = example().chars().collect();
        for (start, length, fragment) in edits {
            let start = start.min(text.len());
            let end = (start + length).min(text.len());
            text.splice(start..end, FRAGMENTS[fragment].chars());
        }
        let text: String = text.into_iter().collect();
        if let Err(problems) = Description::from_str(&text, "scene.yaml", &[]) {
            prop_assert!(problems.iter().count() > 0);
            for problem in problems.iter() {
                prop_assert!(problem.line <= text.split('\n').count() + 1, "{problem}");
                prop_assert!(!problem.to_string().is_empty());
            }
        }
    }

    #[test]
    fn mutated_overrides_never_panic(path in "[a-z0-9.]{0,12}", value in "\\PC{0,12}") {
        let _ = Description::from_str(example(), "scene.yaml", &[(path, value)]);
    }
}
