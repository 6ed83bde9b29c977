//! What is no file, or a file of another kind.

use super::{assert_none, directory};
use smithwalk::description::Description;
use smithwalk::image::read_exr;
use smithwalk::mesh::{Mesh, Wanted};
use smithwalk::texture::{ColorSpace, Interpolation, Lookup, Texture};
use std::path::Path;

/// What is said of a path as a scene, as a mesh, as a texture, and as an image to compare.
fn said(path: &Path) -> [String; 4] {
    let texture = Texture::load(
        path,
        Lookup {
            color_space: ColorSpace::Linear,
            interpolation: Interpolation::Closest,
            ..Lookup::default()
        },
    );
    [
        Description::load(path, &[])
            .expect_err("no scene")
            .to_string(),
        Mesh::load(path, Wanted::ALL)
            .expect_err("no mesh")
            .to_string(),
        texture.expect_err("no texture").to_string(),
        read_exr(path).expect_err("no image").to_string(),
    ]
}

#[test]
fn folders_pipes_and_devices_are_refused_by_name() {
    let folder = directory("special");
    let pipe = folder.join("pipe");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status();
    assert!(made.is_ok_and(|status| status.success()), "mkfifo is there");
    let mut faults = Vec::new();
    for (path, found) in [
        (folder.as_path(), "expected a file, found a folder"),
        (&pipe, "expected a file, found a pipe"),
        (Path::new("/dev/zero"), "expected a file, found a device"),
        (Path::new("/dev/null"), "expected a file, found a device"),
        (&folder.join("none"), "No such file"),
    ] {
        for said in said(path) {
            if said.matches(found).count() != 1 {
                faults.push(format!("{}: {said}", path.display()));
            }
        }
    }
    assert_none(&faults);
}

#[test]
fn other_formats_are_refused_by_name() {
    let folder = directory("formats");
    let mut faults = Vec::new();
    for (bytes, found) in [
        (
            &b"BLENDER-v304RENDH"[..],
            "a Blender file: blender/export.py",
        ),
        (b"\x28\xb5\x2f\xfd\0\0", "as of Blender: blender/export.py"),
        (b"\x1f\x8b\x08\0", "a gzip file"),
        (b"\xff\xfes\0m\0", "UTF-16: save it as UTF-8"),
        (b"\xfe\xff\0s\0m", "UTF-16: save it as UTF-8"),
        (
            b"smithwalk: 1\n# f\xfcr\n",
            "expected UTF-8, found other bytes in line 2",
        ),
    ] {
        let path = folder.join("file");
        std::fs::write(&path, bytes).unwrap();
        let said = Description::load(&path, &[]).expect_err(found).to_string();
        if !said.contains(found) {
            faults.push(format!("{found}: {said}"));
        }
    }
    assert_none(&faults);
}
