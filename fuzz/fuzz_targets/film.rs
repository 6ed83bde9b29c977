#![no_main]
//! A saved film, as `--resume` and `merge` read it. The input is what stands between the
//! magic bytes and the sum, which no mutation would get right.

mod file;

use libfuzzer_sys::fuzz_target;
use smithwalk::film::SavedFilm;
use xxhash_rust::xxh3::xxh3_128;

fuzz_target!(|content: &[u8]| {
    let mut bytes = b"smithwalk film\0\x07".to_vec();
    bytes.extend_from_slice(content);
    bytes.extend_from_slice(&xxh3_128(&bytes).to_le_bytes());
    if let Ok(saved) = SavedFilm::read(&file::written("film", &bytes)) {
        let image = saved.film.develop();
        assert!(image.color.as_flattened().iter().all(|x| x.is_finite()));
        let _ = saved.film.relative_error();
    }
});
