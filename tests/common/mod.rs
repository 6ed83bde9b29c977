//! What several test files share: rendering scene files without the command.

use std::path::{Path, PathBuf};

use smithwalk::description::Description;
use smithwalk::film::{Aov, Film};
use smithwalk::image::{Image, Window};
use smithwalk::integrator::{Control, render};
use smithwalk::scene::{Limits, RenderSettings, Resolved, resolve};

/// A folder for the files of a test; what is in it may be there from before.
pub fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// A scene file with changes, read and built.
pub fn load(path: &Path, overrides: &[(&str, &str)]) -> Resolved {
    let overrides: Vec<(String, String)> = overrides
        .iter()
        .map(|(key, value)| ((*key).to_owned(), (*value).to_owned()))
        .collect();
    let description = Description::load(path, &overrides).unwrap_or_else(|e| panic!("{e}"));
    resolve(&description).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// What a render of a test is like.
#[derive(Clone, Copy)]
pub struct Settings {
    pub spp: u32,
    pub seed: u64,
    /// The kernel with every feature in place of the leanest.
    pub all_in: bool,
    /// These pixels alone.
    pub window: Option<Window>,
}

impl Settings {
    pub fn spp(spp: u32) -> Self {
        Self {
            spp,
            seed: 1,
            all_in: false,
            window: None,
        }
    }
}

/// The film after a render, with the AOVs asked for.
pub fn film(loaded: &Resolved, settings: Settings, aovs: &[Aov]) -> Film {
    let settings = RenderSettings {
        window: settings.window.unwrap_or(loaded.settings.window),
        aovs: aovs.iter().copied().collect(),
        seed: settings.seed,
        limits: Limits::samples(settings.spp),
        all_in: settings.all_in,
        ..loaded.settings.clone()
    };
    let mut film = settings.film();
    render(&loaded.scene, &settings, &mut film, Control::default()).expect("there is a camera");
    assert!(film.faults().is_empty(), "{:?}", film.faults());
    film
}

/// The image of a scene file.
pub fn image(path: &Path, overrides: &[(&str, &str)], settings: Settings, aovs: &[Aov]) -> Image {
    film(&load(path, overrides), settings, aovs).develop()
}
