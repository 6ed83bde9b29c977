#![no_main]
//! An image of any format, as texture and as environment.

mod file;

use libfuzzer_sys::fuzz_target;
use smithwalk::memory::Budget;
use smithwalk::texture::{ColorSpace, Images, Lookup, load_environment};

/// The decoders are others' code: what they run into ends where they are called. The
/// fuzzer would end at the panic itself; what is not caught still ends it.
fn let_panics_be_caught() {
    std::panic::set_hook(Box::new(|_| {}));
}

fuzz_target!(init: let_panics_be_caught(), |bytes: &[u8]| {
    let path = file::written("texture", bytes);
    let budget = Budget::new(1 << 28);
    let images = Images::new(&budget);
    if let Ok((texture, _)) = images.texture(&path, Lookup { color_space: ColorSpace::Srgb, ..Lookup::default() }) {
        assert!(texture.sample([0.3, 0.7]).iter().all(|x| x.is_finite()));
    }
    let _ = load_environment(&path, &Budget::new(1 << 28));
});
