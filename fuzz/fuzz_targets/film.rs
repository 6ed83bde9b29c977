#![no_main]
//! A saved film to resume.

mod file;

use libfuzzer_sys::fuzz_target;
use smithwalk::film::{AovSet, Film};
use smithwalk::image::Window;

fuzz_target!(|bytes: &[u8]| {
    let path = file::written("film", bytes);
    let mut film = Film::new([4, 4], Window::full([4, 4]), AovSet::NONE);
    if film.resume(&path, 0).is_ok() {
        let _ = film.develop();
    }
});
