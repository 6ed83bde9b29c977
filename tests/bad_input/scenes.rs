//! Scene files, overrides and materials.

use super::{directory, without};
use smithwalk::description::{Description, Material};
use std::fmt::Write as _;

/// What is said about each scene, one after the other.
fn scenes(cases: &[(&str, &str)]) -> String {
    let mut said = String::new();
    for (what, text) in cases {
        let text = format!("smithwalk: 1\n{text}");
        let answer = match Description::from_str(&text, "scene.yaml", &[]) {
            Ok(_) => panic!("{what}: expected problems, found none"),
            Err(problems) => problems.to_string(),
        };
        writeln!(said, "# {what}\n{answer}\n").unwrap();
    }
    said
}

#[test]
fn files_that_are_no_scenes() {
    let deep = "[".repeat(100) + &"]".repeat(100);
    let bomb = (1..9).fold(
        "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n".to_owned(),
        |text, i| {
            let alias = format!("*a{}, ", i - 1).repeat(10);
            format!("{text}a{i}: &a{i} [{alias}]\n")
        },
    );
    let mut said = String::new();
    for (what, text) in [
        ("empty", ""),
        ("a comment alone", "# nothing here\n"),
        ("not a mapping", "- 1\n- 2\n"),
        ("a broken list", "smithwalk: 1\nfilm: {width: [1, 2\n"),
        ("a tab as indent", "smithwalk: 1\nfilm:\n\twidth: 3\n"),
        ("two documents", "smithwalk: 1\n---\nsmithwalk: 1\n"),
        ("a tag", "smithwalk: !!int 1\n"),
        ("no version", "film: {width: 8}\n"),
        ("a newer version", "smithwalk: 2\n"),
        ("too deep", &deep),
        ("too many aliases", &bomb),
        ("an alias inside itself", "a: &a [*a]\n"),
        ("an unknown alias", "a: *b\n"),
        ("a list as key", "smithwalk: 1\n[1, 2]: 3\n"),
    ] {
        let answer = match Description::from_str(text, "scene.yaml", &[]) {
            Ok(_) => panic!("{what}: expected problems, found none"),
            Err(problems) => problems.to_string(),
        };
        let short: Vec<String> = answer
            .lines()
            .map(|line| line.chars().take(120).collect())
            .collect();
        writeln!(said, "# {what}\n{}\n", short.join("\n")).unwrap();
    }
    insta::assert_snapshot!(said);
}

#[test]
fn keys_and_types() {
    insta::assert_snapshot!(scenes(&[
        ("a misspelt section", "lihgts: []"),
        ("a misspelt key", "film: {hieght: 3}"),
        (
            "a key of a parent",
            "camera: {projection: {perspective: {}}, fov: 40}"
        ),
        ("a key twice", "film:\n  width: 8\n  height: 8\n  width: 9"),
        ("text for a number", "film: {exposure: bright}"),
        ("a negative count", "film: {width: -8}"),
        ("a fraction for a count", "sampling: {spp: 1.5}"),
        (
            "too short a list",
            "objects: [{mesh: a, transform: {location: [1, 2]}}]\nmeshes: {a: {file: a.obj}}"
        ),
        (
            "too long a list",
            "objects: [{mesh: a, transform: {location: [1, 2, 3, 4]}}]\nmeshes: {a: {file: a.obj}}"
        ),
        ("NaN", "film: {exposure: .nan}"),
        ("infinity", "lights: [point: {power: .inf}]"),
        (
            "a number beyond single precision",
            "lights: [point: {power: 1e40}]"
        ),
        ("an unknown kind", "materials:\n  gold: {conducter: {}}"),
        ("a kind without keys", "film: {filter: box}"),
        (
            "two kinds",
            "world: {constant: {}, environment: {file: a.exr}}"
        ),
        ("a kind that is missing", "lights: [{}]"),
        ("an unknown choice", "sampling: {estimator: two_walk}"),
        ("a missing key", "lights:\n  - area: {power: 3}"),
        (
            "an inline material with two kinds",
            "materials: {m: {mix: {a: {diffuse: {}, emission: {}}, b: {diffuse: {}}}}}"
        ),
        (
            "a texture for what takes none",
            "textures: {t: {file: t.png}}\nworld: {constant: {color: {texture: t}}}"
        ),
    ]));
}

#[test]
fn keys_that_exclude_or_need_each_other() {
    insta::assert_snapshot!(scenes(&[
        (
            "alpha and roughness",
            "materials: {m: {conductor: {alpha: 0.1, roughness: 0.3}}}"
        ),
        (
            "alpha and anisotropy",
            "materials: {m: {conductor: {alpha: 0.1, anisotropy: 0.3}}}"
        ),
        (
            "alpha and alpha_x",
            "materials: {m: {conductor: {alpha: 0.1, alpha_x: 0.3, alpha_y: 1}}}"
        ),
        (
            "alpha_x alone",
            "materials: {m: {dielectric: {alpha_x: 0.1}}}"
        ),
        (
            "eta without k",
            "materials: {m: {conductor: {eta: [0.2, 0.9, 1.1]}}}"
        ),
        ("k without eta", "materials: {m: {conductor: {k: 3}}}"),
        ("f82 without f0", "materials: {m: {conductor: {f82: 0.9}}}"),
        (
            "two reflectances",
            "materials: {m: {conductor: {color: 1, metal: gold}}}"
        ),
        (
            "fov and lens",
            "camera: {projection: {perspective: {fov: 40, lens: 35}}}"
        ),
        (
            "two apertures",
            "camera: {projection: {perspective: {}}, depth_of_field: {fstop: 2, aperture_radius: 0.1, focus_distance: 1}}"
        ),
        (
            "no aperture",
            "camera: {projection: {perspective: {}}, depth_of_field: {focus_distance: 1}}"
        ),
        (
            "matrix and location",
            "lights: [point: {power: 1, transform: {location: [0, 0, 0], matrix: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}}]"
        ),
        (
            "look_at and scale",
            "lights: [point: {power: 1, transform: {scale: 2, look_at: {from: [0, 0, 0], to: [1, 0, 0]}}}]"
        ),
        (
            "material and materials",
            "meshes: {a: {file: a.obj}}\nmaterials: {m: {diffuse: {}}}\nobjects: [{mesh: a, material: m, materials: {x: m}}]"
        ),
    ]));
}

#[test]
fn layers_that_contradict_themselves() {
    let stack = |keys: &str| format!("materials: {{m: {{layered: {{{keys}}}}}}}");
    let cases = [
        ("nothing at all", "interfaces: []"),
        (
            "two bases",
            "interfaces: [], base: {diffuse: {}}, base: {conductor: {}}",
        ),
        (
            "a negative thickness",
            "interfaces: [{absorption: 3, thickness: -1}], base: {diffuse: {}}",
        ),
        ("an index of 0", "interfaces: [{ior: 0}], base: {diffuse: {}}"),
        (
            "absorption said twice",
            "interfaces: [{absorption: 3, transmittance: 0.5}], base: {diffuse: {}}",
        ),
        (
            "thickness of nothing",
            "interfaces: [{thickness: 3}], base: {diffuse: {}}",
        ),
        (
            "a slab that nothing comes through",
            "interfaces: [{transmittance: [0.5, 0, 1]}], base: {diffuse: {}}",
        ),
        ("absorption below all", "interfaces: [{}, {absorption: 1}]"),
        (
            "a tangent of a layer's own",
            "interfaces: [{rotation: 0.25}], base: {conductor: {tangent: {radial: z}}}",
        ),
        (
            "single scattering",
            "interfaces: [{scattering: single}], base: {conductor: {scattering: single}}",
        ),
        ("a base that shines", "interfaces: [{}], base: {emission: {}}"),
        (
            "a stack on a stack",
            "interfaces: [{}], base: {layered: {interfaces: [{}]}}",
        ),
        (
            "a part that is open",
            "interfaces: [{}], base: {mix: {a: {dielectric: {}}, b: {diffuse: {}}}}",
        ),
        (
            "coloured glass",
            "interfaces: [{}], base: {dielectric: {color: 0.5}}",
        ),
        (
            "a mix by Fresnel's factor",
            "interfaces: [{}], base: {mix: {factor: {fresnel: {}}, a: {diffuse: {}}, b: {conductor: {}}}}",
        ),
        (
            "a rough diffuse base",
            "interfaces: [{}], base: {diffuse: {roughness: 0.5}}",
        ),
        ("a base of itself", "interfaces: [{}], base: m"),
    ]
    .map(|(what, keys)| (what, stack(keys)));
    insta::assert_snapshot!(scenes(
        &cases
            .iter()
            .map(|(what, text)| (*what, &**text))
            .collect::<Vec<_>>()
    ));
}

#[test]
fn insides_that_contradict_themselves() {
    let filled = |keys: &str| format!("materials: {{m: {{filled: {{{keys}}}}}}}");
    let cases = [
        ("nothing inside", "surface: {dielectric: {}}"),
        (
            "absorption said twice",
            "surface: {dielectric: {}}, absorption: 1, transmittance: 0.5",
        ),
        ("depth of nothing", "surface: {dielectric: {}}, depth: 1"),
        (
            "no depth",
            "surface: {dielectric: {}}, transmittance: 0.5, depth: 0",
        ),
        (
            "light out of nothing",
            "surface: {dielectric: {}}, absorption: [1, -1, 0]",
        ),
        (
            "filled twice",
            "surface: {filled: {surface: {dielectric: {}}, absorption: 1}}, absorption: 1",
        ),
        (
            "a part of a mix",
            "surface: {mix: {a: {diffuse: {}}, b: {filled: {surface: {dielectric: {}}, absorption: 1}}}}, absorption: 1",
        ),
    ]
    .map(|(what, keys)| (what, filled(keys)));
    let cases: Vec<_> = cases.iter().map(|(what, text)| (*what, &**text)).collect();
    insta::assert_snapshot!(scenes(&cases));
}

#[test]
fn values_out_of_range() {
    insta::assert_snapshot!(scenes(&[
        (
            "roughness above 1",
            "materials: {m: {conductor: {roughness: 1.5}}}"
        ),
        (
            "alpha below 0",
            "materials: {m: {conductor: {alpha: -0.5}}}"
        ),
        (
            "one alpha 0",
            "materials: {m: {conductor: {alpha_x: 0, alpha_y: 0.5}}}"
        ),
        (
            "anisotropy below -1",
            "materials: {m: {conductor: {anisotropy: -2}}}"
        ),
        (
            "an albedo above 1",
            "materials: {m: {diffuse: {color: [0.5, 1.5, 0.5]}}}"
        ),
        ("ior 0", "materials: {m: {dielectric: {ior: 0}}}"),
        (
            "a mix beyond 1",
            "materials: {m: {mix: {factor: 2, a: {diffuse: {}}, b: {diffuse: {}}}}}"
        ),
        ("negative power", "lights: [point: {power: -1}]"),
        (
            "a light without area",
            "lights: [area: {power: 1, shape: {disk: {width: 0, height: 1}}}]"
        ),
        (
            "a light scaled to nothing",
            "lights: [area: {power: 1, shape: {disk: {width: 1, height: 1}}, transform: {scale: [1, 0, 1]}}]"
        ),
        ("a cone of 0 degrees", "lights: [spot: {power: 1, size: 0}]"),
        ("no pixels", "film: {width: 0, height: 100000}"),
        ("no samples", "sampling: {spp: 0}"),
        ("an image twice", "film: {aovs: [normal, depth, normal]}"),
        (
            "a field of view of 180 degrees",
            "camera: {projection: {perspective: {fov: 180}}}"
        ),
        (
            "a camera that looks at itself",
            "camera: {projection: {perspective: {}}, transform: {look_at: {from: [1, 2, 3], to: [1, 2, 3]}}}"
        ),
        (
            "a camera that looks straight down",
            "camera: {projection: {perspective: {}}, transform: {look_at: {from: [0, 0, 3], to: [0, 0, 0]}}}"
        ),
        (
            "a flat matrix",
            "meshes: {a: {file: a.obj}}\nobjects: [{mesh: a, transform: {matrix: [[1, 0, 1, 0], [0, 1, 0, 0], [1, 0, 1, 0], [0, 0, 0, 1]]}}]"
        ),
        (
            "a projective matrix",
            "meshes: {a: {file: a.obj}}\nobjects: [{mesh: a, transform: {matrix: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 1, 1]]}}]"
        ),
    ]));
}

#[test]
fn names_that_nothing_has() {
    let leaf = "materials:\n  leaf: {diffuse: {}}\n  m069: {mix: {a: leaf, b: leaf}}\n".to_owned();
    let chain = (0..69).fold(leaf.clone(), |text, i| {
        format!("{text}  m{i:03}: {{mix: {{a: m{:03}, b: leaf}}}}\n", i + 1)
    });
    // Names sorted the other way round: each finds the next one done.
    let reversed = (0..69).fold(leaf, |text, i| {
        format!(
            "{text}  m{:03}: {{mix: {{a: m{:03}, b: leaf}}}}\n",
            138 - i,
            if i == 68 { 69 } else { 137 - i }
        )
    });
    insta::assert_snapshot!(scenes(&[
        (
            "a mesh",
            "meshes: {sphere: {file: a.obj}}\nobjects: [{mesh: shpere}]"
        ),
        (
            "a material",
            "meshes: {a: {file: a.obj}}\nmaterials: {gold: {conductor: {}}}\nobjects: [{mesh: a, material: Gold}]"
        ),
        (
            "a slot's material",
            "meshes: {a: {file: a.obj}}\nobjects: [{mesh: a, materials: {slot: gold}}]"
        ),
        (
            "a texture",
            "materials: {m: {diffuse: {color: {texture: wood}}}}"
        ),
        (
            "part of a mix",
            "materials: {m: {mix: {a: n, b: {diffuse: {}}}}}"
        ),
        (
            "a mix of itself",
            "materials: {m: {mix: {a: n, b: {diffuse: {}}}}, n: {mix: {a: {diffuse: {}}, b: {mix: {a: m, b: m}}}}}"
        ),
        ("mixes without end", &chain),
        ("mixes without end, last first", &reversed),
        (
            "the name of something faulty is not blamed",
            "meshes: {a: {file: a.obj}}\nmaterials: {gold: {conductor: {roughnes: 1, alpha: x}}}\nobjects: [{mesh: a, material: gold}]",
        ),
    ]));
}

#[test]
fn many_problems_at_once() {
    insta::assert_snapshot!(scenes(&[(
        "each line has one",
        "camera: {projection: {perspective: {fov: wide}}}
film: {width: 0}
sampling: {estimator: wlak}
textures: {t: {file: 3}}
materials:
  gold: {conductor: {roughness: 0.3, alpha: 0.1}}
  glass: {dielectric: {ior: -1}}
  wood: {diffuse: {colour: 1}}
objects:
  - {mesh: plane, material: gold}
  - {mesh: sphere, materail: gold}
  - {mesh: plane, material: glas}
lights:
  - {sun: {strength: -1}}
  - {lamp: {power: 3}}
  - {area: {power: 3, shape: {rectangle: {width: 1, height: 0}}}}"
    )]));
}

#[test]
fn overrides() {
    let scene = "smithwalk: 1\nmaterials: {gold: {conductor: {}}}\nmeshes: {a: {file: a.obj}}\nobjects: [{mesh: a, material: gold}]";
    let mut said = String::new();
    for (path, value) in [
        ("materials.glod.conductor.roughness", "0.3"),
        ("materials.gold.conductor.rougness", "0.3"),
        ("materials.gold.conductor.roughness", "3"),
        ("materials.gold.conductor.roughness", "[1"),
        ("materials.gold.dielectric.ior", "1.5"),
        ("objects.1.mesh", "a"),
        ("objects.Ball.mesh", "a"),
        ("objects.0.mesh.file", "a"),
        ("objects.0.material", "god"),
        ("sampling.spp", ""),
        ("samplign.spp", "3"),
        ("", "3"),
        ("film..width", "3"),
    ] {
        let pair = (path.to_owned(), value.to_owned());
        let problems =
            Description::from_str(scene, "scene.yaml", &[pair]).expect_err("expected problems");
        writeln!(said, "# -D {path}={value}\n{problems}\n").unwrap();
    }
    insta::assert_snapshot!(said);
}

#[test]
fn materials_that_stand_alone() {
    let mut said = String::new();
    for text in [
        "",
        "conductor",
        "condctor: {}",
        "conductor: {alpha: -1}",
        "diffuse: {color: {texture: t}}",
        "mix: {a: x, b: {diffuse: {}}}",
    ] {
        let problems = Material::from_yaml(text).expect_err("expected problems");
        writeln!(said, "# {text}\n{problems}\n").unwrap();
    }
    insta::assert_snapshot!(said);
}

#[test]
fn scene_files_that_cannot_be_read() {
    let directory = directory("bad-scenes");
    std::fs::write(directory.join("latin1.yaml"), b"smithwalk: 1\n# caf\xe9\n").unwrap();
    let mut said = String::new();
    for name in ["missing.yaml", "latin1.yaml", "."] {
        let problems =
            Description::load(&directory.join(name), &[]).expect_err("expected problems");
        writeln!(said, "{}", without(&problems.to_string(), &directory)).unwrap();
    }
    insta::assert_snapshot!(said);
}
