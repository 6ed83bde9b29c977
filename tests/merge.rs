//! What `merge` writes of parts, beside what `render` writes of the whole.

use std::path::Path;

use crate::films::{Room, json, succeeds};

/// What a plain PNG has not: exposure, alpha and a view transform.
const FILM: &str =
    "film: {width: 32, height: 24, exposure: 1.5, transparent: true, aovs: [variance, depth],
  view: {lut: view.cube, log2: {offset: 0.25, min: -2, max: 4}}}";

/// A room whose scene is shown like that.
fn room(name: &str) -> Room {
    let room = Room::new(name);
    let scene = std::fs::read_to_string(room.file("scene.yaml")).unwrap();
    let plain = "film: {width: 32, height: 24, exposure: 0}";
    assert!(scene.contains(plain));
    room.write("scene.yaml", &scene.replace(plain, FILM));
    table(&room, 0.9);
    room
}

/// A table whose colours nothing else gives: red goes to `most`, blue and green swap.
fn table(room: &Room, most: f32) {
    let node = |i: u32| {
        let [r, g, b] = [i % 3, i / 3 % 3, i / 9].map(|n| n as f32 / 2.0);
        format!("{} {} {}\n", r * r * most, b.sqrt(), g)
    };
    let nodes: String = (0..27).map(node).collect();
    room.write("view.cube", &format!("LUT_3D_SIZE 3\n{nodes}"));
}

/// Renders both halves of 8 samples, with further arguments for the second.
fn halves(room: &Room, more: &[&str]) {
    room.render(&["--spp", "8", "--part", "0/2", "-o", "a.film"]);
    let second = ["--spp", "8", "--part", "1/2", "-o", "b.film"];
    room.render(&[&second[..], more].concat());
}

/// Merges into these files, and gives what is said on standard error.
fn merge(room: &Room, parts: &[&str], more: &[&str], outputs: &[&str]) -> String {
    let parts: Vec<String> = parts.iter().map(|name| room.file(name)).collect();
    let outputs: Vec<String> = outputs.iter().map(|name| room.file(name)).collect();
    let mut arguments = vec!["merge"];
    arguments.extend(parts.iter().map(String::as_str));
    arguments.extend(outputs.iter().flat_map(|name| ["-o", name]));
    arguments.extend(more);
    String::from_utf8(succeeds(&arguments).stderr).unwrap()
}

fn bytes(room: &Room, name: &str) -> Vec<u8> {
    std::fs::read(room.file(name)).unwrap()
}

/// Parts merge to the files of the whole: the same bytes as PNG; the same colour, layers
/// and attributes as EXR, but for the seconds of a run. It takes the films alone.
#[test]
fn merged_parts_look_like_the_whole() {
    let room = room("look");
    room.render(&["--spp", "8", "-o", "whole.png", "-o", "whole.exr"]);
    room.render(&["--spp", "8", "-o", "dark.png", "-D", "film.exposure=-1"]);
    room.render(&["--spp", "8", "-o", "plain.png", "-D", "film.view=null"]);
    halves(&room, &[]);
    for gone in ["view.cube", "scene.yaml"] {
        std::fs::remove_file(room.file(gone)).unwrap();
    }

    let said = merge(&room, &["b.film", "a.film"], &[], &["m.png", "m.exr"]);
    assert_eq!(said, "");
    let whole = bytes(&room, "whole.png");
    assert!(bytes(&room, "plain.png") != whole, "the view does nothing");
    assert!(bytes(&room, "m.png") == whole, "another PNG");
    let [merged, whole_exr] = ["m.exr", "whole.exr"].map(|name| room.image(name));
    assert_eq!(merged.color, whole_exr.color);
    assert_eq!(merged.layers, whole_exr.layers);
    let mut expected = whole_exr.attributes;
    expected.retain(|(name, _)| name != "smithwalk.seconds");
    assert_eq!(merged.attributes, expected);

    let dark = ["--exposure", "-1"];
    merge(&room, &["a.film", "b.film"], &dark, &["m.png", "m.exr"]);
    assert!(bytes(&room, "m.png") == bytes(&room, "dark.png"));
    let mark = |name: &str| room.image(name).attribute("smithwalk.complete").is_some();
    assert!(!mark("m.exr"), "the scene says otherwise");

    // A film that was merged is as good as its parts, and a part has its own samples.
    merge(&room, &["a.film"], &[], &["half.film", "half.exr"]);
    assert!(!mark("half.exr"));
    merge(&room, &["half.film", "b.film"], &[], &["m.png"]);
    assert!(bytes(&room, "m.png") == whole);

    let told = succeeds(&["film", &room.file("a.film")]);
    let told = String::from_utf8(told.stdout).unwrap();
    assert!(
        told.contains("PNGs: exposure 1.5, a table of 3³ colours"),
        "{told}"
    );
    let told = json(&["film", &room.file("a.film"), "--json"]);
    assert_eq!(told["display"]["exposure"], 1.5);
    assert_eq!(told["display"]["view"]["nodes"], 3);
    assert_eq!(told["display"]["view"]["log2"]["min"], -2.0);
}

/// What an image is complete by is the table's colours, wherever they lie.
#[test]
fn a_view_transform_counts_by_its_colours() {
    let room = room("colours");
    let mark = |name: &str, more: &[&str]| {
        room.render(&[&["--spp", "1", "-o", name][..], more].concat());
        room.image(name)
            .attribute("smithwalk.complete")
            .map(str::to_owned)
    };
    let first = mark("a.exr", &[]);
    assert!(first.is_some());
    let moved = String::from_utf8(bytes(&room, "view.cube")).unwrap();
    room.write("moved.cube", &moved);
    let elsewhere = ["-D", "film.view.lut=moved.cube"];
    assert_eq!(mark("b.exr", &elsewhere), first);
    table(&room, 0.25);
    assert_ne!(mark("c.exr", &[]), first);
}

/// Parts that look different merge, since their samples do not, and it is told how.
#[test]
fn parts_that_look_different_are_told() {
    let room = room("different");
    room.render(&["--spp", "8", "-o", "whole.png"]);
    let told = |more: &[&str], expected: &[&str]| {
        let said = merge(&room, &["a.film", "b.film"], more, &["m.png"]);
        assert_eq!(said.is_empty(), expected.is_empty(), "{said}");
        for text in expected {
            assert!(said.contains(text), "{text}: {said}");
        }
        bytes(&room, "m.png") == bytes(&room, "whole.png")
    };
    let as_first = ["b.film has ", "; PNGs are as ", "a.film says"];

    halves(&room, &["-D", "film.exposure=0.7"]);
    let digits = json(&["film", &room.file("b.film"), "--json"]);
    assert_eq!(digits["display"]["exposure"], 0.7);

    halves(&room, &["-D", "film.exposure=-0.5"]);
    let exposure = ["exposure -0.5, not 1.5"];
    assert!(told(&[], &[&as_first[..], &exposure].concat()));
    assert!(told(&["--exposure", "1.5"], &[]));

    halves(&room, &["-D", "film.view=null"]);
    let none = ["b.film has no view transform"];
    assert!(told(&[], &[&none[..], &as_first[1..]].concat()));

    table(&room, 0.8);
    let second = ["--spp", "8", "--part", "1/2", "-o", "b.film"];
    room.render(&second);
    assert!(told(
        &[],
        &[&as_first[..], &["another view transform"]].concat()
    ));
}

/// Films of the format before are read: their PNGs are plain sRGB, by name, or as other
/// parts say.
#[test]
fn films_that_do_not_say_how_they_look_are_told() {
    let room = room("older");
    room.render(&["--spp", "8", "-o", "whole.png"]);
    let plain = ["-D", "film.view=null", "-D", "film.exposure=0"];
    room.render(&[&["--spp", "8", "-o", "plain.png"][..], &plain].concat());
    halves(&room, &[]);
    age(&room.0.join("a.film"));
    let said = merge(&room, &["a.film", "b.film"], &[], &["m.png"]);
    let older = "a.film is of an older format, without exposure and view transform; PNGs are ";
    assert!(
        said.contains(older) && said.contains("b.film says"),
        "{said}"
    );
    assert!(bytes(&room, "m.png") == bytes(&room, "whole.png"));

    age(&room.0.join("b.film"));
    let said = merge(&room, &["a.film", "b.film"], &[], &["m.png"]);
    assert!(
        said.contains(older) && said.contains("plain sRGB"),
        "{said}"
    );
    assert!(bytes(&room, "m.png") == bytes(&room, "plain.png"));
    let said = merge(&room, &["a.film", "b.film"], &[], &["m.exr"]);
    assert_eq!(said, "");

    // It goes on, and says how it looks from then on.
    let more = ["--spp", "8", "--part", "0/2", "-o", "a.film", "--resume"];
    room.render(&more);
    merge(&room, &["a.film", "b.film"], &[], &["m.png"]);
    assert!(bytes(&room, "m.png") == bytes(&room, "whole.png"));
}

/// Makes a film one of format 6, which ended its header with the share and had no table.
fn age(path: &Path) {
    const MAGIC: usize = 16;
    let new = std::fs::read(path).unwrap();
    let word = |at: usize| u32::from_le_bytes(new[at..at + 4].try_into().unwrap()) as usize;
    let start = MAGIC + 4;
    let end = start + word(MAGIC);
    let mut header: serde_json::Value = serde_json::from_slice(&new[start..end]).unwrap();
    for key in ["scene", "complete"] {
        let fields = header.as_object_mut().unwrap();
        assert!(fields.remove(key).is_some(), "{key}");
    }
    let header = serde_json::to_vec(&header).unwrap();
    // The exposure, nodes per side, where in the table values are, the nodes.
    let tiles = end + 4 + 4 + 12 + 12 * word(end + 4).pow(3);
    let mut old = new[..MAGIC].to_vec();
    old[MAGIC - 1] = 6;
    old.extend((header.len() as u32).to_le_bytes());
    old.extend(&header);
    old.extend(&new[tiles..new.len() - 16]);
    let sum = xxhash_rust::xxh3::xxh3_128(&old);
    old.extend(sum.to_le_bytes());
    std::fs::write(path, old).unwrap();
}
