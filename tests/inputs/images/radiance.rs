//! Radiance files.

use crate::inputs::directory;
use super::Becomes::{Mean, Refused, Told};
use super::{check, load};

/// A file of the size that the last line of its header says.
fn hdr(header: &str, pixels: &[[u8; 4]]) -> Vec<u8> {
    [header.as_bytes(), pixels.as_flattened()].concat()
}

#[test]
fn radiance_files() {
    let start = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n";
    // Mantissas and exponent of (1, 0.5, 0.25).
    let sky = [[128, 64, 32, 129]; 32];
    let colour = [1.0, 0.5, 0.25];
    let of = |header: &str| hdr(header, &sky);
    let run_length = {
        let mut file = format!("{start}-Y 1 +X 8\n").into_bytes();
        file.extend([2, 2, 0, 8]);
        for value in [128, 64, 32, 129] {
            file.extend([128 + 8, value]);
        }
        file
    };
    let old_runs = hdr(&format!("{start}-Y 1 +X 8\n"), &[sky[0], [1, 1, 1, 7]]);
    let no_end = format!("#?RADIANCE\n{}", "A=B\n".repeat(5000)).into_bytes();
    let said = "that the image file gives is not applied";
    check(
        "hdr",
        1e-6,
        &[
            ("RADIANCE", of(&format!("{start}-Y 4 +X 8\n")), Mean(colour)),
            ("RGBE", of("#?RGBE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 8\n"), Mean(colour)),
            ("a program's own name", of("#?AUTOPANO\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 8\n"), Mean(colour)),
            ("no format", of("#?RADIANCE\n\n-Y 4 +X 8\n"), Mean(colour)),
            ("comments", of("#?RADIANCE\n# by hand\npfilt -1\nFORMAT=32-bit_rle_rgbe\nSOFTWARE=a\n\n-Y 4 +X 8\n"), Mean(colour)),
            ("line ends of Windows", of("#?RADIANCE\r\nFORMAT=32-bit_rle_rgbe\r\n\r\n-Y 4 +X 8\n"), Mean(colour)),
            ("bytes that are no text", [b"#?RADIANCE\n# f\xfcr\n\n-Y 4 +X 8\n", sky.as_flattened()].concat(), Mean(colour)),
            ("from the bottom", of(&format!("{start}+Y 4 +X 8\n")), Mean(colour)),
            ("from the right", of(&format!("{start}-Y 4 -X 8\n")), Mean(colour)),
            ("by columns", of(&format!("{start}+X 8 -Y 4\n")), Mean(colour)),
            ("by columns from the right bottom", of(&format!("{start}-X 8 +Y 4\n")), Mean(colour)),
            ("runs", run_length, Mean(colour)),
            ("runs of old files", old_runs, Mean(colour)),
            ("an exposure of 1", of("#?RADIANCE\nEXPOSURE=1.0\n\n-Y 4 +X 8\n"), Mean(colour)),
            ("an exposure", of("#?RADIANCE\nEXPOSURE= 2.5\n\n-Y 4 +X 8\n"), Told(colour, said)),
            ("a colour correction", of("#?RADIANCE\nCOLORCORR=1 2 1\n\n-Y 4 +X 8\n"), Told(colour, said)),
            ("a gamma", of("#?RADIANCE\nGAMMA=2.2\n\n-Y 4 +X 8\n"), Told(colour, said)),
            ("XYZ", of("#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 4 +X 8\n"), Refused("expected the format 32-bit_rle_rgbe, found `32-bit_rle_xyze`")),
            ("too few pixels", hdr(&format!("{start}-Y 4 +X 8\n"), &sky[..31]), Refused("the image is broken")),
            ("no size", of(start), Refused("the image is broken")),
            ("a size in words", of(&format!("{start}four by eight\n")), Refused("expected a size such as `-Y 512 +X 1024`, found `four by eight`")),
            ("two heights", of(&format!("{start}-Y 4 -Y 8\n")), Refused("found `-Y 4 -Y 8`")),
            ("no pixels", of(&format!("{start}-Y 0 +X 8\n")), Refused("without pixels")),
            ("a size past 32 bits", of(&format!("{start}-Y 4294967296 +X 8\n")), Refused("found `-Y 4294967296 +X 8`")),
            ("20000 × 20000 pixels of nothing", of(&format!("{start}-Y 20000 +X 20000\n")), Refused("it claims 4.8 GB of pixels")),
            ("a header without end", no_end, Refused("its header has no end")),
            ("a header that stops", b"#?RADIANCE\nFORM".to_vec(), Refused("its header ends in the middle")),
        ],
    );

    // One pixel of each colour, from the lower left over the lower right on.
    let [red, green, blue, white] = [[128, 0, 0, 129], [0, 128, 0, 129], [0, 0, 128, 129], [128, 128, 128, 129]];
    let path = directory("axes").join("image");
    for (layout, pixels) in [
        ("-Y 2 +X 2", [blue, white, red, green]),
        ("+Y 2 +X 2", [red, green, blue, white]),
        ("-Y 2 -X 2", [white, blue, green, red]),
        ("+Y 2 -X 2", [green, red, white, blue]),
        ("+X 2 -Y 2", [blue, red, white, green]),
        ("+X 2 +Y 2", [red, blue, green, white]),
        ("-X 2 -Y 2", [white, green, blue, red]),
        ("-X 2 +Y 2", [green, white, red, blue]),
    ] {
        std::fs::write(&path, hdr(&format!("{start}{layout}\n"), &pixels)).unwrap();
        let (texture, _) = load(&path).unwrap();
        let at = |u, v| texture.sample([u, v])[..3].to_vec();
        assert_eq!(at(0.25, 0.25), [1.0, 0.0, 0.0], "{layout}: lower left");
        assert_eq!(at(0.75, 0.25), [0.0, 1.0, 0.0], "{layout}: lower right");
        assert_eq!(at(0.25, 0.75), [0.0, 0.0, 1.0], "{layout}: upper left");
        assert_eq!(at(0.75, 0.75), [1.0, 1.0, 1.0], "{layout}: upper right");
    }
}
