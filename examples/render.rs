//! Renders a scene file to an image, by the library alone.
//!
//! ```text
//! cargo run --release --example render -- scenes/gold_sphere/scene.yaml gold.exr
//! ```

use std::path::Path;

use smithwalk::description::Description;
use smithwalk::image::{Display, OutputPath};
use smithwalk::integrator::{Control, render};
use smithwalk::scene::{Resolved, resolve};

fn main() -> anyhow::Result<()> {
    let [scene, image] = [1, 2].map(|i| std::env::args().nth(i).expect("SCENE.yaml OUT.exr"));
    let description = Description::load(Path::new(&scene), &[])?;
    let Resolved {
        scene, settings, ..
    } = resolve(&description)?;
    let mut film = settings.film();
    render(&scene, &settings, &mut film, Control::default())?;
    let display = Display::srgb(description.film.exposure);
    OutputPath::new(image)?.write(&film.develop(), &display)?;
    Ok(())
}
