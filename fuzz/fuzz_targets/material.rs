#![no_main]
//! A material on the command line, `bsdf --material`.

use libfuzzer_sys::fuzz_target;
use smithwalk::description::Material;

fuzz_target!(|text: &str| {
    let _ = Material::from_yaml(text);
});
