//! OBJ files: the area of what is read, or what is said.

use super::assert_none;
use smithwalk::mesh::{Mesh, Wanted};
use std::io::Cursor;

/// What becomes of a file.
enum Becomes {
    /// An area in m², so many triangles, and nothing to tell.
    Area(f64, usize),
    /// As above, and this is told.
    Told(f64, usize, &'static str),
    /// This is said.
    Refused(&'static str),
}
use Becomes::{Area, Refused, Told};

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
/// An arrowhead of a quarter of a square metre; its notch is the second vertex.
const ARROW: &str = "v 1 0 0\nv .25 .25 0\nv 0 1 0\nv 0 0 0\n";

fn area(mesh: &Mesh) -> f64 {
    let corner = |index: u32| glam::DVec3::from(mesh.positions[index as usize].map(f64::from));
    let areas = mesh.triangles.iter().map(|triangle| {
        let [a, b, c] = triangle.map(corner);
        (b - a).cross(c - a).length() / 2.0
    });
    areas.sum()
}

fn check(cases: &[(&str, Vec<u8>, Becomes)]) {
    let mut faults = Vec::new();
    for (what, bytes, becomes) in cases {
        let read = Mesh::read(Cursor::new(&bytes[..]), "m.obj", Wanted::ALL);
        let found = match &read {
            Ok((mesh, repairs)) => {
                let repairs: Vec<_> = repairs.iter().map(ToString::to_string).collect();
                let found = format!("{} m², {} triangles, {repairs:?}", area(mesh), mesh.triangles.len());
                let (expected, triangles, told) = match becomes {
                    Area(area, triangles) => (*area, *triangles, None),
                    Told(area, triangles, told) => (*area, *triangles, Some(*told)),
                    Refused(_) => (f64::NAN, 0, None),
                };
                let told = match told {
                    Some(told) => repairs.iter().any(|repair| repair.contains(told)),
                    None => repairs.is_empty(),
                };
                let near = (area(mesh) - expected).abs() <= 1e-6 * expected;
                if near && mesh.triangles.len() == triangles && told {
                    continue;
                }
                found
            }
            Err(error) => {
                let error = error.to_string();
                match becomes {
                    Refused(message) if error.contains(message) && error.len() < 2000 => continue,
                    _ => error,
                }
            }
        };
        faults.push(format!("{what}: {found}"));
    }
    assert_none(&faults);
}

/// A square with this for its face, or before it.
fn square(rest: &str) -> Vec<u8> {
    format!("{SQUARE}{rest}").into_bytes()
}

fn bytes(text: &str) -> Vec<u8> {
    text.as_bytes().to_vec()
}

#[test]
fn names_and_comments() {
    let latin1 = |before: &[u8], after: &str| [before, b"\n", &square(after)].concat();
    check(&[
        ("an empty usemtl, as Blender writes", square("usemtl \nf 1 2 3 4\n"), Area(1.0, 2)),
        ("an empty usemtl without a blank", square("usemtl\nf 1 2 3 4\n"), Area(1.0, 2)),
        ("an empty usemtl after a name", square("usemtl a\nf 1 2 3\nusemtl \nf 1 3 4\n"), Area(1.0, 2)),
        ("an empty usemtl twice", square("usemtl \nf 1 2 3\nusemtl a\nusemtl \nf 1 3 4\n"), Area(1.0, 2)),
        ("a comment in Latin-1", latin1(b"# f\xfcr", "f 1 2 3 4\n"), Area(1.0, 2)),
        ("a comment in Shift-JIS", latin1(b"# \x83\x81\x83\x62", "f 1 2 3 4\n"), Area(1.0, 2)),
        ("an object in Latin-1", latin1(b"o W\xfcrfel", "f 1 2 3 4\n"), Area(1.0, 2)),
        ("a group in GBK", latin1(b"g \xb5\xd8\xb0\xe5", "f 1 2 3 4\n"), Area(1.0, 2)),
        ("a library in Latin-1", latin1(b"mtllib K\xfcche.mtl", "f 1 2 3 4\n"), Area(1.0, 2)),
        ("a material in Latin-1", latin1(b"usemtl gr\xfcn", "f 1 2 3 4\n"), Area(1.0, 2)),
        ("a comment that ends in a backslash", square("# C:\\models\\\nf 1 2 3 4\n"), Area(1.0, 2)),
        ("a comment behind a face", square("f 1 2 3 4 # f 1 2 3\n"), Area(1.0, 2)),
        ("a comment right behind a face", square("f 1 2 3 4# f 1 2 3\n"), Area(1.0, 2)),
        ("a comment behind a vertex", bytes(&SQUARE.replace("1 1 0", "1 1 0 # 5")).into_iter().chain(*b"f 1 2 3 4\n").collect(), Area(1.0, 2)),
        ("a comment without a blank", square("#f 1 2 3\nf 1 2 3 4\n"), Area(1.0, 2)),
        ("an object without a name", square("o\nf 1 2 3 4\n"), Area(1.0, 2)),
        ("many groups at once", square("g a b c\nf 1 2 3 4\n"), Area(1.0, 2)),
        ("smoothing groups and levels of detail", square("s off\ns 1\nlod 3\nmg 1 2\nbevel on\nc_interp off\nf 1 2 3 4\n"), Area(1.0, 2)),
        ("a library that is not there", square("mtllib a.mtl b.mtl\nusemtl a\nf 1 2 3 4\n"), Area(1.0, 2)),
        ("blanks round a name", square("usemtl \t a \t\nf 1 2 3 4\n"), Area(1.0, 2)),
    ]);
    let names = |text: Vec<u8>| {
        let (mesh, _) = Mesh::read(Cursor::new(text), "m.obj", Wanted::ALL).unwrap();
        (mesh.material_names, mesh.material_of_triangle)
    };
    let both = names(square("usemtl a\nf 1 2 3\nusemtl \nf 1 3 4\n"));
    assert_eq!(both, (vec!["a".to_owned(), String::new()], Some(vec![0, 1])));
    let before = names(square("f 1 2 3\nusemtl \nf 1 2 3\nusemtl a\nf 1 3 4\n"));
    assert_eq!(before, (vec![String::new(), "a".to_owned()], Some(vec![0, 0, 1])));
    let latin1 = names([&square("usemtl gr")[..], b"\xfcn\nf 1 2 3\nusemtl gr\xf6n\nf 1 3 4\n"].concat());
    assert_eq!(latin1.0, ["grün", "grön"]);
}

#[test]
fn lines_and_encodings() {
    let plain = format!("{SQUARE}f 1 2 3 4\n");
    check(&[
        ("Unix", bytes(&plain), Area(1.0, 2)),
        ("Windows", bytes(&plain.replace('\n', "\r\n")), Area(1.0, 2)),
        ("old Macs", bytes(&plain.replace('\n', "\r")), Area(1.0, 2)),
        ("two line ends in one file", bytes(&plain.replacen('\n', "\r", 2)), Area(1.0, 2)),
        ("no line end at the end", bytes(plain.trim_end()), Area(1.0, 2)),
        ("a byte order mark", bytes(&format!("\u{feff}{plain}")), Area(1.0, 2)),
        ("tabs", bytes(&plain.replace(' ', "\t")), Area(1.0, 2)),
        ("many blanks", bytes(&plain.replace(' ', " \t  ")), Area(1.0, 2)),
        ("indented lines", bytes(&plain.replace('\n', "  \n   ")), Area(1.0, 2)),
        ("empty lines", bytes(&plain.replace('\n', "\n\n \n")), Area(1.0, 2)),
        ("a continued face", square("f 1 2 \\\n3 4\n"), Area(1.0, 2)),
        ("a continued face on Windows", square("f 1 2 \\\r\n3 4\r\n"), Area(1.0, 2)),
        ("a continued face on old Macs", square("f 1 2 \\\r3 4\r"), Area(1.0, 2)),
        ("a face continued twice", square("f 1 \\\n 2 \\\n 3 4\n"), Area(1.0, 2)),
        ("a continued vertex", bytes("v 0 0\\\n 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n"), Area(0.5, 1)),
        ("a continued line at the end", square("f 1 2 3 4 \\"), Area(1.0, 2)),
        ("UTF-16, little endian", b"\xff\xfev\0 \x000\0".to_vec(), Refused("found text in UTF-16")),
        ("UTF-16, big endian", b"\xfe\xff\0v\0 ".to_vec(), Refused("found text in UTF-16")),
        ("UTF-16 without a mark", b"v\0 \x000\0 \x000\0".to_vec(), Refused("m.obj:1: expected text, found a byte of value 0")),
        ("zeros", vec![0; 4096], Refused("a byte of value 0")),
        ("a PLY file", bytes("ply\nformat ascii 1.0\n"), Refused("found a PLY file")),
        ("an STL file", bytes("solid cube\nfacet normal 0 0 1\n"), Refused("found an STL file")),
        ("an FBX file", b"Kaydara FBX Binary  \0".to_vec(), Refused("found an FBX file")),
        ("a glTF file", b"glTF\x02\0\0\0".to_vec(), Refused("found a glTF file")),
        ("a Blender file", b"BLENDER-v304".to_vec(), Refused("found a Blender file")),
        ("a gzip file", b"\x1f\x8b\x08\0".to_vec(), Refused("found a gzip file")),
        ("a ZIP file", b"PK\x03\x04\n".to_vec(), Refused("found a ZIP file")),
        ("a web page", bytes("<!DOCTYPE html>\n<html>"), Refused("found an XML file")),
        ("a USD file", bytes("#usda 1.0\n"), Refused("found a USD file")),
        ("nothing", Vec::new(), Refused("the mesh has no faces")),
        ("a comment alone", bytes("# nothing\n"), Refused("the mesh has no faces")),
        ("vertices alone", bytes(SQUARE), Refused("the mesh has no faces")),
        ("a line of 70 MB", vec![b'f'; 70_000_000], Refused("a line is longer than 67108864 bytes")),
        ("a terminal's commands", square("f \u{1b}[31m 2 3\n"), Refused("found `\\u{1b}[31m`")),
        ("a long word", square(&format!("f {} 2 3\n", "x".repeat(100_000))), Refused("xxx…`")),
    ]);
}

#[test]
fn numbers() {
    let with = |number: &str| format!("v 0 0 0\nv 1 0 0\nv 0 {number} 0\nf 1 2 3\n").into_bytes();
    check(&[
        ("an exponent", with("1e0"), Area(0.5, 1)),
        ("a capital exponent with a sign", with("10E-01"), Area(0.5, 1)),
        ("a plus", with("+1"), Area(0.5, 1)),
        ("no digit before the point", with(".5"), Area(0.25, 1)),
        ("no digit behind the point", with("1."), Area(0.5, 1)),
        ("minus zero", bytes("v -0 0 0\nv 1 -0.0 0\nv 0 1 0\nf 1 2 3\n"), Area(0.5, 1)),
        ("many digits", with("1.00000000000000000000000000000000000000000000000000000000000"), Area(0.5, 1)),
        ("denormal", bytes("v 1e-42 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), Area(0.5, 1)),
        ("Fortran's exponent", with("1.0D+00"), Refused("m.obj:3: expected a number, found `1.0D+00`")),
        ("a comma for the point", with("0,5"), Refused("m.obj:3: expected a number, found `0,5`")),
        ("commas between numbers", with("1,"), Refused("expected a number, found `1,`")),
        ("an underscore", with("1_0"), Refused("expected a number, found `1_0`")),
        ("hexadecimal", with("0x1p0"), Refused("expected a number, found `0x1p0`")),
        ("two points", with("1.2.3"), Refused("m.obj:3: position parse error")),
        ("a sign alone", with("-"), Refused("m.obj:3: position parse error")),
        ("a Unicode minus", with("\u{2212}1"), Refused("expected a number, found `\u{2212}1`")),
        ("a unit", with("1m"), Refused("expected a number, found `1m`")),
        ("one too few", bytes("v 0 0\nv 1 0 0\n"), Refused("m.obj:1: expected 3 numbers after `v`, found 2")),
        ("none", bytes("v\n"), Refused("m.obj:1: expected 3 numbers after `v`, found 0")),
        ("a normal of two numbers", square("vn 0 1\nf 1//1 2//1 3//1\n"), Refused("m.obj:5: expected 3 numbers after `vn`, found 2")),
        ("no texture coordinate", square("vt\nf 1/1 2/1 3/1\n"), Refused("expected 1 numbers after `vt`, found 0")),
        ("NaN", with("nan"), Refused("m.obj:3: expected finite coordinates, found `nan`")),
        ("infinity", with("-inf"), Refused("expected finite coordinates, found `-inf`")),
        ("beyond single precision", with("1e39"), Refused("expected finite coordinates, found `1e39`")),
        ("too far", with("1e19"), Refused("expected coordinates up to 1e18 m")),
        ("MSVC's infinity", with("1.#INF"), Refused("expected finite coordinates, found `1.#INF`")),
        ("MSVC's NaN", with("-1.#IND"), Refused("expected finite coordinates, found `-1.#IND`")),
        ("MSVC's infinity of digits", with("1.#INF000e+00"), Refused("expected finite coordinates")),
        ("glibc's NaN", with("-nan"), Refused("expected finite coordinates, found `-nan`")),
        ("a newer MSVC's NaN", with("-nan(ind)"), Refused("expected finite coordinates, found `-nan(ind)`")),
        ("MSVC's NaN as texture coordinate", square("vt .25 1.#QNAN\nf 1/1 2/1 3/1 4/1\n"), Told(1.0, 2, "vertices without usable texture coordinates given (0, 0)")),
        ("three of them", square("vt -1.#IND00 -1.#IND00 -1.#IND00\nf 1/1 2/1 3/1 4/1\n"), Told(1.0, 2, "texture coordinates given (0, 0)")),
        ("MSVC's infinity rounded to two digits", square("vt 1.#J 0\nf 1/1 2/1 3/1 4/1\n"), Told(1.0, 2, "texture coordinates given (0, 0)")),
        ("MSVC's NaN as normal", square("vn 0 0 1.#QNAN\nf 1//1 2//1 3//1\n"), Told(0.5, 1, "3 corners without a usable normal")),
        ("NaN as normal", square("vn nan nan nan\nf 1//1 2//1 3//1\n"), Told(0.5, 1, "3 corners without a usable normal")),
        ("a normal of length 0", square("vn 0 0 0\nf 1//1 2//1 3//1\n"), Told(0.5, 1, "3 corners without a usable normal")),
        ("an infinite texture coordinate", square("vt inf 0\nf 1/1 2/1 3/1\n"), Told(0.5, 1, "(0, 0)")),
    ]);
    let read = |text: &str| Mesh::read(Cursor::new(square(text)), "m.obj", Wanted::ALL).unwrap().0;
    let uvs = read("vt .25 1.#QNAN\nvt .5\nvt .5 .25 7\nvt .5 .25 0 1\nf 1/1 2/2 3/3 4/4\n").uvs;
    assert_eq!(uvs, Some(vec![[0.0, 0.0], [0.5, 0.0], [0.5, 0.25], [0.5, 0.25]]));
}

#[test]
fn what_vertices_carry() {
    let vertices = |more: &str| bytes(&(SQUARE.replace(" 0\n", &format!(" 0{more}\n")) + "f 1 2 3 4\n"));
    let normal = "vn 0 0 1\n";
    check(&[
        ("a colour", vertices(" .1 .2 .3"), Area(1.0, 2)),
        ("a colour and its alpha", vertices(" .1 .2 .3 1"), Area(1.0, 2)),
        ("a colour of bytes", vertices(" 255 0 128"), Area(1.0, 2)),
        ("two further numbers", vertices(" 1 2"), Area(1.0, 2)),
        ("a weight of 1", vertices(" 1.0"), Area(1.0, 2)),
        ("a weight of 2, which divides", vertices(" 2"), Area(0.25, 2)),
        ("a weight of 0", vertices(" 0"), Refused("m.obj:1:")),
        ("absent normals", square("f 1//1 2//2 3//3 4//4\n"), Told(1.0, 2, "4 corners name normals, of which the file has none: shaded flat")),
        ("absent normals, counted back", square("f -4//-4 -3//-3 -2//-2\n"), Told(0.5, 1, "3 corners name normals")),
        ("absent texture coordinates", square("f 1/1 2/2 3/3 4/4\n"), Told(1.0, 2, "4 corners name texture coordinates")),
        ("absent both", square("f 1/1/1 2/2/2 3/3/3\n"), Told(0.5, 1, "3 corners name normals")),
        ("absent normals in two groups", square("g a\nf 1//1 2//2 3//3\ng b\nf 1//1 3//3 4//4\n"), Told(1.0, 2, "6 corners name normals")),
        ("absent normals beside texture coordinates", square("vt 0 0\nf 1/1/1 2/1/2 3/1/3\n"), Told(0.5, 1, "3 corners name normals")),
        ("normals that nobody names", square(&format!("{normal}f 1 2 3 4\n")), Area(1.0, 2)),
        ("a normal out of range", square(&format!("{normal}f 1//1 2//2 3//1\n")), Refused("m.obj:6: there is no normal 2, only 1")),
        ("a normal counted back too far", square(&format!("{normal}f 1//1 2//-2 3//1\n")), Refused("there is no normal -2: only 1 came before")),
        ("a normal counted back before any came", square(&format!("f 1//-1 2//-1 3//-1\n{normal}")), Refused("m.obj:5: there is no normal -1: none came before")),
        ("a texture coordinate out of range", square("vt 0 0\nf 1/1 2/1 3/2\n"), Refused("there is no texture coordinate 2, only 1")),
        ("normals for some corners", square(&format!("{normal}f 1//1 2//1 3\n")), Told(0.5, 1, "shaded flat, since corners lack normals")),
        ("normals behind the faces", square(&format!("f 1//1 2//1 3//1\n{normal}")), Area(0.5, 1)),
        ("parameters of curves", square("vp .5 .5\nvp 1\nf 1 2 3 4\n"), Area(1.0, 2)),
    ]);
}

#[test]
fn faces() {
    check(&[
        ("indices counted back", square("f -4 -3 -2 -1\n"), Area(1.0, 2)),
        ("both ways of counting", square("f 1 -3 3 -1\n"), Area(1.0, 2)),
        ("slashes with nothing between", square("f 1// 2/ 3// 4/\n"), Area(1.0, 2)),
        ("a plus", square("f +1 +2 +3\n"), Area(0.5, 1)),
        ("leading zeros", square("f 01 002 3\n"), Area(0.5, 1)),
        ("faces before vertices", bytes(&format!("f 1 2 3 4\n{SQUARE}")), Area(1.0, 2)),
        ("an old face", square("fo 1 2 3 4\n"), Area(1.0, 2)),
        ("a face of two corners", square("f 1 2\nf 1 2 3 4\n"), Told(1.0, 2, "1 points, lines and curves left out")),
        ("a face of one corner", square("f 1\nf 1 2 3 4\n"), Told(1.0, 2, "1 points, lines and curves left out")),
        ("points and lines", square("p 1 2\nl 1 2 3\nf 1 2 3 4\n"), Told(1.0, 2, "2 points, lines and curves left out")),
        ("curves and surfaces", square("cstype bspline\ndeg 3 3\ncurv 0 1 1 2 3\nparm u 0 1\nend\nf 1 2 3 4\n"), Told(1.0, 2, "1 points, lines and curves left out")),
        ("a vertex twice in a row", square("f 1 1 2 3 4\n"), Told(1.0, 2, "triangles without area left out")),
        ("the first vertex again at the end", square("f 1 2 3 4 1\n"), Told(1.0, 2, "triangles without area left out")),
        ("a triangle of two vertices", square("f 1 2 2\nf 1 2 3\n"), Told(0.5, 1, "1 triangles without area left out")),
        ("triangles without area alone", square("f 1 2 2\n"), Refused("none of the 1 triangles has an area")),
        ("unknown words", square("F 1 2 3\nfoo 1\nf 1 2 3 4\n"), Told(1.0, 2, "2 lines that begin with no known word left out, the first in line 5")),
        ("another file", square("call other.obj\nf 1 2 3\n"), Refused("m.obj:5: `call` takes in another file")),
        ("no corner", square("f\n"), Refused("m.obj:5: expected the corners of a face, found nothing")),
        ("a vertex 0", square("f 0 1 2\n"), Refused("indices start at 1, found a vertex 0")),
        ("a vertex out of range", square("f 1 2 5\n"), Refused("m.obj:5: there is no vertex 5, only 4")),
        ("a vertex counted back too far", square("f -5 -1 -2\n"), Refused("there is no vertex -5: only 4 came before")),
        ("a huge index", square("f 1 2 99999999999\n"), Refused("there is no vertex 99999999999")),
        ("an index past 64 bits", square("f 1 2 99999999999999999999\n"), Refused("expected the index of a vertex, found `99999999999999999999`")),
        ("the least index", square("f 1 2 -9223372036854775808\n"), Refused("there is no vertex -9223372036854775808")),
        ("a fraction as index", square("f 1.0 2 3\n"), Refused("expected the index of a vertex, found `1.0`")),
        ("names as indices", square("f a b c\n"), Refused("expected the index of a vertex, found `a`")),
        ("commas between corners", square("f 1,2,3\n"), Refused("expected the index of a vertex, found `1,2,3`")),
        ("four indices at a corner", square("f 1/1/1/1 2 3\n"), Refused("expected a corner like 1/2/3, found `1/1/1/1`")),
        ("a corner without a vertex", square("f /1 2 3\n"), Refused("expected the index of a vertex, found ``")),
    ]);
}

/// Corners in a plane as vertices and one face, put into space by `place`.
fn polygon(corners: &[[f64; 2]], place: impl Fn([f64; 2]) -> [f64; 3]) -> Vec<u8> {
    let mut text = String::new();
    for [x, y, z] in corners.iter().map(|&corner| place(corner)) {
        text += &format!("v {x} {y} {z}\n");
    }
    text += "f";
    for index in 1..=corners.len() {
        text += &format!(" {index}");
    }
    (text + "\n").into_bytes()
}

#[test]
fn polygons() {
    let flat = |[x, y]: [f64; 2]| [x, y, 0.0];
    let arrow = [[1.0, 0.0], [0.25, 0.25], [0.0, 1.0], [0.0, 0.0]];
    let turned = |by: usize| {
        let mut arrow = arrow;
        arrow.rotate_left(by);
        arrow
    };
    let backwards = [arrow[3], arrow[2], arrow[1], arrow[0]];
    let l = [[0., 0.], [2., 0.], [2., 1.], [1., 1.], [1., 2.], [0., 2.]];
    let u = [[0., 0.], [3., 0.], [3., 3.], [2., 3.], [2., 1.], [1., 1.], [1., 3.], [0., 3.]];
    let comb: Vec<[f64; 2]> = (0..20).map(|i| [f64::from(i), if i % 2 == 0 { 2.0 } else { 1.0 }]).chain([[19.0, 0.0], [0.0, 0.0]]).collect();
    let star: Vec<[f64; 2]> = (0..10)
        .map(|i| {
            let (sin, cos) = (std::f64::consts::PI * f64::from(i) / 5.0).sin_cos();
            let r = if i % 2 == 0 { 2.0 } else { 0.5 };
            [r * cos, r * sin]
        })
        .collect();
    // Ten triangles between neighbouring radii.
    let star_area = 10.0 * 0.5 * 2.0 * 0.5 * (std::f64::consts::PI / 5.0).sin();
    let keyhole = [[0., 0.], [4., 0.], [4., 4.], [0., 4.], [0., 0.], [1., 1.], [1., 3.], [3., 3.], [3., 1.], [1., 1.]];
    let spiral = [[0., 0.], [5., 0.], [5., 5.], [1., 5.], [1., 2.], [3., 2.], [3., 3.], [2., 3.], [2., 4.], [4., 4.], [4., 1.], [0., 1.]];
    let shoelace = |corners: &[[f64; 2]]| {
        let next = corners.iter().cycle().skip(1);
        let sum: f64 = corners.iter().zip(next).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum();
        sum.abs() / 2.0
    };
    let ngon = |n: u32| -> Vec<[f64; 2]> {
        (0..n)
            .map(|i| {
                let angle = std::f64::consts::TAU * f64::from(i) / f64::from(n);
                [angle.cos(), angle.sin()]
            })
            .collect()
    };
    let cut = "faces of more than four corners cut into triangles";
    let hexagon = 1.5 * 3f64.sqrt();
    check(&[
        ("an arrowhead", polygon(&arrow, flat), Area(0.25, 2)),
        ("from its tail", polygon(&turned(1), flat), Area(0.25, 2)),
        ("from its other tip", polygon(&turned(2), flat), Area(0.25, 2)),
        ("from its point", polygon(&turned(3), flat), Area(0.25, 2)),
        ("backwards", polygon(&backwards, flat), Area(0.25, 2)),
        ("upright", polygon(&arrow, |[x, y]| [x, 0.0, y]), Area(0.25, 2)),
        ("sideways", polygon(&arrow, |[x, y]| [0.0, x, y]), Area(0.25, 2)),
        ("tilted", polygon(&arrow, |[x, y]| [x, 0.6 * y, 0.8 * y]), Area(0.25, 2)),
        ("far away", polygon(&arrow, |[x, y]| [x + 4096.0, y - 4096.0, 4096.0]), Area(0.25, 2)),
        ("tiny", polygon(&arrow, |[x, y]| [x * 1e-9, y * 1e-9, 0.0]), Area(0.25e-18, 2)),
        ("huge", polygon(&arrow, |[x, y]| [x * 1e9, y * 1e9, 0.0]), Area(0.25e18, 2)),
        ("an L", polygon(&l, flat), Told(3.0, 4, cut)),
        ("a U", polygon(&u, flat), Told(7.0, 6, cut)),
        ("a comb", polygon(&comb, flat), Told(shoelace(&comb), 20, cut)),
        ("a star", polygon(&star, flat), Told(star_area, 8, cut)),
        ("a spiral", polygon(&spiral, flat), Told(shoelace(&spiral), 10, cut)),
        ("a hole by an edge there and back", polygon(&keyhole, flat), Told(12.0, 8, cut)),
        ("a corner in the middle of a side", polygon(&[[0., 0.], [0.5, 0.], [1., 0.], [1., 1.], [0., 1.]], flat), Told(1.0, 2, "without area")),
        ("a spike of no area", polygon(&[[0., 0.], [2., 0.], [1., 0.], [1., 1.], [0., 1.]], flat), Told(1.0, 2, "without area")),
        ("a hexagon", polygon(&ngon(6), flat), Told(hexagon, 4, cut)),
        ("a hexagon upside down", polygon(&ngon(6), |[x, y]| [y, x, 0.0]), Told(hexagon, 4, cut)),
        ("a quad that is not plane", bytes("v 0 0 0\nv 1 0 0\nv 1 1 1\nv 0 1 0\nf 1 2 3 4\n"), Area(2f64.sqrt(), 2)),
        ("a bow-tie", polygon(&[[0., 0.], [1., 0.], [0., 1.], [2., 2.]], flat), Told(1.0, 1, "1 polygons that cross themselves")),
        ("concave ones in a row", [ARROW.to_owned(), "f 1 2 3 4\n".repeat(100)].concat().into_bytes(), Area(25.0, 200)),
        ("concave ones by indices counted back", bytes(&format!("{ARROW}f -4 -3 -2 -1\n")), Area(0.25, 2)),
        ("a concave one with all there is", bytes(&format!("{ARROW}vt 0 0\nvt 1 0\nvn 0 0 1\nf 1/1/1 2/2/1 3/1/1 4/2/1\n")), Area(0.25, 2)),
    ]);
}
