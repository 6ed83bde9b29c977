#![no_main]
//! An OBJ file: what is read can be rendered.

use libfuzzer_sys::fuzz_target;
use smithwalk::mesh::{Mesh, Wanted};
use std::io::Cursor;

fuzz_target!(|bytes: &[u8]| {
    if let Ok((mesh, _)) = Mesh::read(Cursor::new(bytes), "mesh.obj", Wanted::ALL) {
        let count = mesh.positions.len();
        assert!(mesh.triangles.as_flattened().iter().all(|&i| (i as usize) < count));
        assert!(mesh.positions.as_flattened().iter().all(|x| x.is_finite()));
        assert!(mesh.normals.is_none_or(|normals| normals.len() == count));
        assert!(mesh.uvs.is_none_or(|uvs| uvs.len() == count));
    }
});
