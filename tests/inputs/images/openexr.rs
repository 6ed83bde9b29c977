//! OpenEXR files.

use crate::inputs::directory;
use super::Becomes::{Mean, Refused, Told};
use super::check;
use exr::prelude::*;

const SIZE: Vec2<usize> = Vec2(4, 4);

fn channels(values: &[(&str, f32)], half: bool) -> AnyChannels<FlatSamples> {
    let count = SIZE.area();
    let list = values.iter().map(|&(name, value)| {
        let samples = if half { FlatSamples::F16(vec![f16::from_f32(value); count]) } else { FlatSamples::F32(vec![value; count]) };
        AnyChannel::new(name, samples)
    });
    AnyChannels::sort(list.collect())
}

fn layer(name: Option<&str>, values: &[(&str, f32)], encoding: Encoding) -> exr::prelude::Layer<AnyChannels<FlatSamples>> {
    let attributes = LayerAttributes { layer_name: name.map(Text::from), ..LayerAttributes::default() };
    exr::prelude::Layer::new(SIZE, attributes, encoding, channels(values, false))
}

fn written(layers: Vec<exr::prelude::Layer<AnyChannels<FlatSamples>>>) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let image = exr::prelude::Image { attributes: ImageAttributes::with_size(SIZE), layer_data: layers.into_iter().collect::<smallvec::SmallVec<[_; 2]>>() };
    image.write().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

/// A file with channels of these names, each of one value.
fn exr_file(values: &[(&str, f32)]) -> Vec<u8> {
    written(vec![layer(None, values, Encoding::SMALL_LOSSLESS)])
}

/// The header of a file of one float channel, and nothing more.
fn exr_header(side: i32) -> Vec<u8> {
    let mut file = b"\x76\x2f\x31\x01\x02\0\0\0".to_vec();
    let mut attribute = |name: &str, kind: &str, data: &[u8]| {
        file.extend(name.as_bytes());
        file.push(0);
        file.extend(kind.as_bytes());
        file.push(0);
        file.extend((data.len() as i32).to_le_bytes());
        file.extend(data);
    };
    let channel = b"Y\0\x02\0\0\0\0\0\0\0\x01\0\0\0\x01\0\0\0\0";
    let window: Vec<u8> = [0, 0, side - 1, side - 1].iter().flat_map(|n: &i32| n.to_le_bytes()).collect();
    attribute("channels", "chlist", channel);
    attribute("compression", "compression", &[0]);
    attribute("dataWindow", "box2i", &window);
    attribute("displayWindow", "box2i", &window);
    attribute("lineOrder", "lineOrder", &[0]);
    attribute("pixelAspectRatio", "float", &1f32.to_le_bytes());
    attribute("screenWindowCenter", "v2f", &[0; 8]);
    attribute("screenWindowWidth", "float", &1f32.to_le_bytes());
    file.push(0);
    file
}

#[test]
fn exr_files() {
    let rgb = [("R", 1.0), ("G", 0.5), ("B", 0.25)];
    let colour = [1.0, 0.5, 0.25];
    let with = |more: &[(&'static str, f32)]| exr_file(&[&rgb[..], more].concat());
    let encoded = |compression, blocks| {
        let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
        written(vec![layer(None, &rgb, encoding)])
    };
    let half = {
        let mut bytes = std::io::Cursor::new(Vec::new());
        let layer = exr::prelude::Layer::new(SIZE, LayerAttributes::default(), Encoding::SMALL_LOSSLESS, channels(&rgb, true));
        exr::prelude::Image { attributes: ImageAttributes::with_size(SIZE), layer_data: layer }.write().to_buffered(&mut bytes).unwrap();
        bytes.into_inner()
    };
    let albedo = [("R", 0.1), ("G", 0.1), ("B", 0.1)];
    let small = Encoding::SMALL_LOSSLESS;
    let parts = |first: (&'static str, &[(&str, f32)]), second: (&'static str, &[(&str, f32)])| written(vec![layer(Some(first.0), first.1, small), layer(Some(second.0), second.1, small)]);
    let whole = exr_file(&rgb);
    let several = "but more than one layer could be meant";
    let mut header_alone = whole.clone();
    header_alone.truncate(whole.len() - 100);
    check(
        "exr",
        1e-6,
        &[
            ("three channels", whole.clone(), Mean(colour)),
            ("halves", half, Mean(colour)),
            ("alpha", with(&[("A", 0.0)]), Mean(colour)),
            ("depth beside it", with(&[("Z", 9.0)]), Mean(colour)),
            ("a layer that sorts before", with(&[("Albedo.R", 0.1), ("Albedo.G", 0.1), ("Albedo.B", 0.1)]), Mean(colour)),
            ("a layer that sorts behind", with(&[("albedo.R", 0.1), ("albedo.G", 0.1), ("albedo.B", 0.1)]), Mean(colour)),
            ("normals beside it", with(&[("N.X", 0.0), ("N.Y", 0.3), ("N.Z", 1.0)]), Mean(colour)),
            (
                "Blender's layers",
                exr_file(&[
                    ("ViewLayer.AO.R", 0.1),
                    ("ViewLayer.AO.G", 0.1),
                    ("ViewLayer.AO.B", 0.1),
                    ("ViewLayer.Combined.R", 1.0),
                    ("ViewLayer.Combined.G", 0.5),
                    ("ViewLayer.Combined.B", 0.25),
                ]),
                Mean(colour),
            ),
            ("one layer of a name", exr_file(&[("beauty.R", 1.0), ("beauty.G", 0.5), ("beauty.B", 0.25)]), Mean(colour)),
            ("two layers of a name", exr_file(&[("a.R", 1.0), ("a.G", 0.5), ("a.B", 0.25), ("b.R", 1.0), ("b.G", 0.5), ("b.B", 0.25)]), Refused(several)),
            (
                "two combined ones",
                exr_file(&[("a.Combined.R", 1.0), ("a.Combined.G", 0.5), ("a.Combined.B", 0.25), ("b.Combined.R", 1.0), ("b.Combined.G", 0.5), ("b.Combined.B", 0.25)]),
                Refused(several),
            ),
            ("small letters", exr_file(&[("r", 1.0), ("g", 0.5), ("b", 0.25)]), Mean(colour)),
            ("normals alone", exr_file(&[("X", 0.0), ("Y", 0.3), ("Z", 1.0)]), Mean([0.0, 0.3, 1.0])),
            ("luminance", exr_file(&[("Y", 0.3)]), Mean([0.3; 3])),
            ("luminance and alpha", exr_file(&[("Y", 0.3), ("A", 0.5)]), Mean([0.3; 3])),
            ("luminance and chroma", exr_file(&[("Y", 0.3), ("RY", 0.0), ("BY", 0.0)]), Refused("and chroma (RY, BY) is not read")),
            ("a depth alone", exr_file(&[("Z", 7.0)]), Mean([7.0; 3])),
            ("a channel of any name", exr_file(&[("mask", 0.5)]), Mean([0.5; 3])),
            ("two channels of any name", exr_file(&[("u", 0.5), ("v", 0.5)]), Refused("but no layer has R, G and B; found u, v")),
            ("two colours alone", exr_file(&[("R", 0.5), ("G", 0.5)]), Refused("but no layer has R, G and B")),
            ("parts, the colour first", parts(("beauty", &rgb), ("depth", &[("Z", 1.0)])), Mean(colour)),
            ("parts, the colour last", parts(("depth", &[("Z", 1.0)]), ("beauty", &rgb)), Mean(colour)),
            ("parts of Blender", parts(("ViewLayer.AO", &albedo), ("ViewLayer.Combined", &rgb)), Mean(colour)),
            ("parts with colours both", parts(("a", &albedo), ("b", &rgb)), Refused(several)),
            ("no compression", encoded(Compression::Uncompressed, Blocks::ScanLines), Mean(colour)),
            ("RLE", encoded(Compression::RLE, Blocks::ScanLines), Mean(colour)),
            ("ZIP by lines", encoded(Compression::ZIP1, Blocks::ScanLines), Mean(colour)),
            ("PIZ", encoded(Compression::PIZ, Blocks::ScanLines), Mean(colour)),
            ("PXR24", encoded(Compression::PXR24, Blocks::ScanLines), Mean(colour)),
            ("tiles", encoded(Compression::ZIP16, Blocks::Tiles(Vec2(3, 2))), Mean(colour)),
            ("NaN and infinity", exr_file(&[("R", f32::NAN), ("G", f32::INFINITY), ("B", 0.25)]), Told([0.0, 0.0, 0.25], "32 values that are NaN, infinite")),
            ("half of it", header_alone, Refused("the EXR image can't be read")),
            ("its magic alone", b"\x76\x2f\x31\x01".to_vec(), Refused("the EXR image can't be read")),
            ("a version that is none", b"\x76\x2f\x31\x01\x09\0\0\0".to_vec(), Refused("the EXR image can't be read")),
            ("10⁶ × 10⁶ pixels of nothing", exr_header(1_000_000), Refused("it claims 4.0 TB of pixels")),
            ("30000 × 30000 pixels of nothing", exr_header(30_000), Refused("it claims 3.6 GB of pixels")),
            ("2³¹ pixels a side", exr_header(i32::MAX), Refused("the EXR image can't be read")),
        ],
    );
    let bytes = exr_header(1_000_000);
    let path = directory("diff").join("huge.exr");
    std::fs::write(&path, bytes).unwrap();
    let error = smithwalk::image::read_exr(&path).expect_err("no pixels").to_string();
    assert!(error.contains("it claims 4.0 TB of pixels"), "{error}");
}
