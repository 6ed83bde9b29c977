//! OBJ files.

use super::{directory, without};
use smithwalk::mesh::{Mesh, Wanted};
use std::fmt::Write as _;
use std::io::Cursor;

#[test]
fn meshes() {
    const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let early = format!("{}f 1 2 4\n{TRIANGLE}", "f 1 2 3\n".repeat(30));
    let cases: &[(&str, &[u8])] = &[
        ("empty", b""),
        ("no faces", b"v 0 0 0\nv 1 0 0\n"),
        (
            "lines and points alone",
            b"v 0 0 0\nv 1 0 0\nl 1 2\np 1\nf 1 2\n",
        ),
        ("NaN", b"v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
        (
            "infinity by overflow",
            b"v 0 0 1e39\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
        ),
        ("too far away", b"v 0 0 1e30\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
        (
            "a position that is no number",
            b"v 0 0 x1\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
        ),
        (
            "a digit too many dots",
            b"v 0 0 1.2.3\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
        ),
        ("two coordinates", b"v 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
        ("index 0", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n"),
        ("an index too far", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n"),
        (
            "a relative index too far",
            b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf -1 -2 -4\n",
        ),
        (
            "the lowest index",
            b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf -9223372036854775808 2 3\n",
        ),
        (
            "the highest index",
            b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 9223372036854775807 2 3\n",
        ),
        (
            "an index beyond 64 bits",
            b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 99999999999999999999 2 3\n",
        ),
        (
            "a normal that is not there",
            b"v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//2 3//1\n",
        ),
        (
            "a relative texture coordinate",
            b"v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/-9 2/1 3/1\n",
        ),
        (
            "a word for an index",
            b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 three\n",
        ),
        (
            "four indices at a corner",
            b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/1/1/1 2 3\n",
        ),
        (
            "a face of nothing",
            b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf\nf 1 2 3\n",
        ),
        ("no area", b"v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\nf 1 1 2\n"),
        (
            "several at once",
            b"v 0 0 0\nv 1 0\nv 0 1 0\nf 1 2 9\nf 1 2 x\nusemtl\nf 1 2 0\n",
        ),
        (
            "an index too far among many that come early",
            early.as_bytes(),
        ),
        ("scaled by 0", b"v 0 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
    ];
    assert!(
        Mesh::read(
            Cursor::new(format!("{TRIANGLE}f 1 2 3\n")),
            "mesh.obj",
            Wanted::ALL
        )
        .is_ok()
    );
    let mut said = String::new();
    for (what, bytes) in cases {
        let error = match Mesh::read(Cursor::new(*bytes), "mesh.obj", Wanted::ALL) {
            Ok(_) => panic!("{what}: expected an error, found none"),
            Err(error) => error,
        };
        writeln!(said, "# {what}\n{error}\n").unwrap();
    }
    let directory = directory("bad-meshes");
    for name in ["missing.obj", "."] {
        let error = Mesh::load(&directory.join(name), Wanted::ALL).expect_err("expected an error");
        writeln!(
            said,
            "# {name}\n{}\n",
            without(&error.to_string(), &directory)
        )
        .unwrap();
    }
    insta::assert_snapshot!(said);
}
