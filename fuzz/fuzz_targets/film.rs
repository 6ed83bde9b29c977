#![no_main]
//! A saved film, as `--resume` and `merge` read it.

mod file;

use libfuzzer_sys::fuzz_target;
use smithwalk::film::SavedFilm;

fuzz_target!(|bytes: &[u8]| {
    let _ = SavedFilm::read(&file::written("film", bytes));
});
