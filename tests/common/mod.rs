//! What several test files share: rendering scene files without the command.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use smithwalk::description::{Description, Filter};
use smithwalk::film::{Aov, Film, PixelFilter};
use smithwalk::image::{Image, Window};
use smithwalk::integrator::{Limits, RenderRequest, render};
use smithwalk::scene::{Scene, resolve};

/// A scene file with changes, read and built.
pub fn load(path: &Path, overrides: &[(&str, &str)]) -> (Description, Scene) {
    let overrides: Vec<(String, String)> = overrides
        .iter()
        .map(|(key, value)| ((*key).to_owned(), (*value).to_owned()))
        .collect();
    let description = Description::load(path, &overrides).unwrap_or_else(|e| panic!("{e}"));
    let scene = resolve(&description)
        .unwrap_or_else(|e| panic!("{}: {e}", path.display()))
        .scene;
    (description, scene)
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
pub fn film(description: &Description, scene: &Scene, settings: Settings, aovs: &[Aov]) -> Film {
    let resolution = [description.film.width, description.film.height];
    let window = settings.window.unwrap_or(Window::full(resolution));
    let mut film = Film::new(resolution, window, aovs.iter().copied().collect());
    let filter = match description.film.filter {
        Filter::Box {} => PixelFilter::box_filter(),
        Filter::BlackmanHarris { width } => PixelFilter::blackman_harris(width),
    };
    let request = RenderRequest {
        scene,
        camera: scene.camera.as_ref().expect("the scene has a camera"),
        filter: &filter,
        seed: settings.seed,
        limits: Limits::samples(settings.spp),
        all_in: settings.all_in,
        interrupt: &AtomicBool::new(false),
    };
    render(&request, &mut film, |_| ());
    assert!(film.faults().is_empty(), "{:?}", film.faults());
    film
}

/// The image of a scene file.
pub fn image(path: &Path, overrides: &[(&str, &str)], settings: Settings, aovs: &[Aov]) -> Image {
    let (description, scene) = load(path, overrides);
    film(&description, &scene, settings, aovs).develop()
}
