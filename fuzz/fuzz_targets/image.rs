#![no_main]
//! An OpenEXR file for `diff`.

mod file;

use libfuzzer_sys::fuzz_target;
use smithwalk::image::read_exr;

fuzz_target!(|bytes: &[u8]| {
    let _ = read_exr(&file::written("image.exr", bytes));
});
