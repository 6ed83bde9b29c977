#![no_main]
//! A scene file: whatever is wrong with it is told in few words.

use libfuzzer_sys::fuzz_target;
use smithwalk::description::Description;

fuzz_target!(|text: &str| {
    if let Err(problems) = Description::from_str(text, "scene.yaml", &[]) {
        assert!(problems.to_string().len() < 200_000);
    }
});
