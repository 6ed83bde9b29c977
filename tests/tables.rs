//! Tables for other programs, and verdicts on those of others.

use std::collections::HashMap;
use std::f64::consts::PI;
use std::io::{Cursor, Read};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;
use smithwalk::description::{Estimator, Material};
use smithwalk::scene::compile_alone;
use smithwalk::tables::{AngleTable, Angles, Rgl, Source, TableError, merl, rgl};

fn material(yaml: &str) -> smithwalk::scene::Material {
    let material = Material::from_yaml(yaml).expect("a material");
    compile_alone(&material, Estimator::Auto).expect("no names")
}

const ANGLES: Angles = Angles {
    theta_i: 3,
    theta_o: 4,
    phi: 5,
};

/// An array of a numpy archive: its header, and the numbers.
fn member(archive: &[u8], name: &str) -> (String, Vec<f64>) {
    let mut zip = zip::ZipArchive::new(Cursor::new(archive)).expect("an archive");
    let mut bytes = Vec::new();
    let mut file = zip.by_name(&format!("{name}.npy")).expect(name);
    file.read_to_end(&mut bytes).expect("its bytes");
    assert_eq!(&bytes[..8], b"\x93NUMPY\x01\x00");
    let begin = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    assert_eq!(begin % 64, 0);
    let header = String::from_utf8(bytes[10..begin].to_vec()).expect("ASCII");
    let numbers = bytes[begin..].chunks_exact(8);
    let numbers = numbers.map(|b| f64::from_le_bytes(b.try_into().expect("eight")));
    (header, numbers.collect())
}

/// Against the closed form of the quadratic distribution's mirrors (Dupuy 2026), all
/// angles; 5 standard errors of 60 values: false alarm 4e-5.
#[test]
fn archives_hold_f() {
    let mirror = material("conductor: {distribution: quadratic}");
    let source = Source::new(&mirror, 2000, 1).expect("isotropic");
    let table = AngleTable::measure(&source, ANGLES);
    let text = ("material", "conductor".to_owned());
    let archive = table.npz(&[text]).expect("an archive");
    let (header, f) = member(&archive, "f");
    assert!(
        header.contains("'<f8'") && header.contains("(3, 4, 5, 3, )"),
        "{header}"
    );
    let (_, errors) = member(&archive, "f_stderr");
    let angles = |name: &str| member(&archive, name).1;
    let (theta_i, theta_o, phi) = (angles("theta_i"), angles("theta_o"), angles("phi"));
    assert_eq!([theta_i.len(), theta_o.len(), phi.len()], [3, 4, 5]);
    for (index, (value, error)) in f.iter().zip(&errors).enumerate().step_by(3) {
        let index = index / 3;
        let (i, o, p) = (theta_i[index / 20], theta_o[index / 5 % 4], phi[index % 5]);
        let dot = i.sin() * o.sin() * p.cos() + i.cos() * o.cos();
        let exact = (i.cos() + o.cos()) / (PI * (1.0 + dot));
        assert!(
            (value - exact).abs() < 5.0 * error + 1e-5 * exact,
            "{i} {o} {p}: {value} ± {error} against {exact}"
        );
        assert!(*error < 0.05 * exact);
    }
    let image = table.image(&[]);
    assert_eq!(image.resolution, [5, 12]);
    assert_eq!(f64::from(image.color[7][1]), f64::from(f[7 * 3 + 1] as f32));
}

/// Lambert's law is the same in every cell above the horizon.
#[test]
fn merl_has_its_scales() {
    let matte = material("diffuse: {color: [0.2, 0.5, 0.8]}");
    let source = Source::new(&matte, 2, 1).expect("isotropic");
    let file = merl(&source).expect("opaque");
    let size = file[..12].chunks_exact(4);
    let size: Vec<i32> = size
        .map(|b| i32::from_le_bytes(b.try_into().expect("four")))
        .collect();
    assert_eq!(size, [90, 90, 180]);
    let cells = 90 * 90 * 180;
    assert_eq!(file.len(), 12 + 3 * 8 * cells);
    let at = |index: usize| {
        let begin = 12 + 8 * index;
        f64::from_le_bytes(file[begin..begin + 8].try_into().expect("eight"))
    };
    for (channel, (color, scale)) in [(0.2, 1.0), (0.5, 1.15), (0.8, 1.66)]
        .into_iter()
        .enumerate()
    {
        let lit = (0..cells).map(|cell| at(channel * cells + cell) * scale / 1500.0);
        let mut lit: Vec<f64> = lit.filter(|&f| f != 0.0).collect();
        assert!(lit.len() > cells / 4 && lit.len() < cells);
        lit.sort_unstable_by(f64::total_cmp);
        let (least, most) = (lit[0], lit[lit.len() - 1]);
        assert!((least * PI / color - 1.0).abs() < 1e-5, "{least}");
        assert!((most * PI / color - 1.0).abs() < 1e-5, "{most}");
    }
}

/// The fields of a tensor file: kind, shape and bytes.
fn fields(file: &[u8]) -> HashMap<String, (u8, Vec<u64>, &[u8])> {
    assert_eq!(&file[..14], b"tensor_file\0\x01\x00");
    let number = |at: usize, bytes: usize| {
        let mut buffer = [0; 8];
        buffer[..bytes].copy_from_slice(&file[at..at + bytes]);
        u64::from_le_bytes(buffer)
    };
    let mut at = 18;
    let mut all = HashMap::new();
    for _ in 0..number(14, 4) {
        let length = number(at, 2) as usize;
        let name = String::from_utf8(file[at + 2..at + 2 + length].to_vec()).expect("a name");
        at += 2 + length;
        let (axes, kind, begin) = (
            number(at, 2) as usize,
            file[at + 2],
            number(at + 3, 8) as usize,
        );
        at += 11;
        let shape: Vec<u64> = (0..axes).map(|i| number(at + 8 * i, 8)).collect();
        at += 8 * axes;
        let size = if kind == 1 { 1 } else { 4 };
        let end = begin + size * shape.iter().product::<u64>() as usize;
        all.insert(name, (kind, shape, &file[begin..end]));
    }
    all
}

/// The fields and shapes that Mitsuba's `measured` asks for.
#[test]
fn tensors_are_what_readers_ask_for() {
    let gold = material("conductor: {alpha: 0.5, color: [1, 0.71, 0.29]}");
    let source = Source::new(&gold, 4, 1).expect("isotropic");
    let size = Rgl {
        theta_i: 3,
        side: 8,
    };
    let file = rgl(&source, size, "gold").expect("opaque");
    let fields = fields(&file);
    for (name, kind, shape) in [
        ("description", 1, &[4][..]),
        ("jacobian", 1, &[1]),
        ("phi_i", 10, &[1]),
        ("theta_i", 10, &[3]),
        ("ndf", 10, &[2, 256]),
        ("sigma", 10, &[2, 256]),
        ("vndf", 10, &[1, 3, 129, 129]),
        ("luminance", 10, &[1, 3, 8, 8]),
        ("rgb", 10, &[1, 3, 3, 8, 8]),
    ] {
        let (found, axes, data) = &fields[name];
        assert_eq!((*found, axes.as_slice()), (kind, shape), "{name}");
        if kind == 10 {
            let numbers = data.chunks_exact(4);
            let numbers = numbers.map(|b| f32::from_le_bytes(b.try_into().expect("four")));
            assert!(numbers.clone().all(|x| x >= 0.0 && x.is_finite()), "{name}");
            assert!(
                numbers.clone().any(|x| x > 0.0) || name == "phi_i",
                "{name}"
            );
        }
    }
}

#[test]
fn what_no_table_holds_is_refused() {
    let refused = |yaml: &str| Source::new(&material(yaml), 2, 1).err();
    let brushed = "conductor: {alpha_x: 0.1, alpha_y: 0.3}";
    assert_eq!(refused(brushed), Some(TableError::Anisotropic));
    assert_eq!(refused("conductor: {alpha: 0}"), Some(TableError::Smooth));
    let glass = material("dielectric: {alpha: 0.3}");
    let source = Source::new(&glass, 2, 1).expect("isotropic");
    assert_eq!(merl(&source).err(), Some(TableError::Transmits));
    let below = AngleTable::measure(&source, ANGLES);
    assert_eq!(below.theta_o.len(), 8);
    assert!(
        below
            .values
            .iter()
            .any(|v| v.value[0] > 0.0 && v.error[0] > 0.0)
    );
}

fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&path);
    std::fs::create_dir_all(&path).expect("a folder for the test");
    path
}

fn conform(name: &str, table: &str) -> (Output, Value) {
    let path = folder(name).join("table.csv");
    std::fs::write(&path, table).expect("the table");
    let output = Command::new(env!("CARGO_BIN_EXE_smithwalk"))
        .args(["conform", "--samples", "16384", "--json", "--against"])
        .arg(&path)
        .output()
        .expect("the program starts");
    let report = serde_json::from_slice(&output.stdout).unwrap_or(Value::Null);
    (output, report)
}

/// f of the quadratic distribution's mirror, exact but for `off` standard errors of 1 %.
fn closed_form(off: f64, rows: usize) -> String {
    let mut table = "quantity,distribution,cos,cos_o,azimuth_o,value,stderr\n".to_owned();
    for row in 0..rows {
        let (cos, out, azimuth) = (0.9 - 0.06 * row as f64, 0.4, 30.0 * row as f64);
        let sines = f64::sqrt((1.0 - cos * cos) * (1.0 - out * out));
        let dot = sines * f64::to_radians(azimuth).cos() + cos * out;
        let f = (cos + out) / (PI * (1.0 + dot));
        let (value, error) = (f * (1.0 + 0.01 * off), 0.01 * f);
        table += &format!("f,quadratic,{cos},{out},{azimuth},{value:.9},{error:.9}\n");
    }
    table
}

#[test]
fn a_table_that_is_right_conforms() {
    let (output, report) = conform("conform-right", &closed_form(0.0, 12));
    assert_eq!(output.status.code(), Some(0), "{report}");
    assert_eq!(report["differing"], 0);
    let rows = report["rows"].as_array().expect("rows");
    assert!(rows.iter().all(|row| row["verdict"] == "agrees"));
}

/// 3 standard errors: in a table of one row by that row, in one of twelve, where no row
/// may be told by itself, by all together.
#[test]
fn planted_errors_of_three_sigma_are_found() {
    let (output, report) = conform("conform-one", &closed_form(3.0, 1));
    assert_eq!(output.status.code(), Some(1), "{report}");
    assert_eq!(report["rows"][0]["verdict"], "differs");
    let (output, report) = conform("conform-all", &closed_form(-3.0, 12));
    assert_eq!(output.status.code(), Some(1), "{report}");
    assert_eq!(report["differ_together"], true);
}

/// Cycles 4.5 on gold of roughness 1, the rows of docs/albedo.md: value, standard error,
/// and what the page says it is off by.
#[test]
fn cycles_is_told_what_the_page_says() {
    let rows = [
        (0.999, 0.464_20, -0.027_25),
        (0.75, 0.484_56, -0.035_08),
        (0.5, 0.515_09, -0.041_35),
        (0.25, 0.567_13, -0.041_11),
        (0.1, 0.624_78, -0.029_97),
        (0.05, 0.654_98, -0.021_46),
    ];
    let mut table = "alpha,color,cos,value,stderr,freedom,note\n".to_owned();
    for (cos, value, _) in rows {
        table += &format!("1,0.71,{cos},{value:.5},0.00001,15,cosθ {cos}\n");
    }
    let (output, report) = conform("conform-cycles", &table);
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(report["differing"], 6, "{report}");
    for (row, (_, _, expected)) in report["rows"].as_array().expect("rows").iter().zip(rows) {
        let number = |name: &str| row[name].as_f64().expect("a number");
        let (error, stderr) = (number("error"), number("stderr"));
        assert!((error - expected).abs() < 5.0 * stderr + 2e-4, "{row}");
    }
}

#[test]
fn tables_that_are_none_are_refused_by_line() {
    let (output, _) = conform("conform-bad", "alpha,cos,value\n0.5,0.5,0.9\n0.5,2,0.9\n");
    assert_eq!(output.status.code(), Some(2));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(
        said.contains("line 3: `cos`: expected -1 to 1, found 2"),
        "{said}"
    );
}
