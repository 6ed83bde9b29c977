//! What is rendered of a scene, how far, and how: all that decides about an image
//! beside the scene itself.

use std::ops::Range;
use std::time::Duration;

use crate::description::{Description, Filter};
use crate::film::{Aov, AovSet, Film, PixelFilter};
use crate::image::Window;

/// When to stop. Whatever is reached first counts.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Samples per pixel of the whole image, those of a resumed film and of other parts
    /// included.
    pub spp: u32,
    /// Wall-clock time.
    pub time: Option<Duration>,
    /// Estimated relative error of the image; see [`Film::relative_error`].
    pub noise: Option<f64>,
}

impl Limits {
    /// So many samples per pixel, however long they take.
    #[must_use]
    pub fn samples(spp: u32) -> Self {
        Self {
            spp,
            time: None,
            noise: None,
        }
    }
}

/// How a scene is rendered.
#[derive(Clone, Debug)]
pub struct RenderSettings {
    /// Width and height of the full image in pixels.
    pub resolution: [u32; 2],
    /// The part of it that is rendered.
    pub window: Window,
    /// How samples spread within a pixel.
    pub filter: PixelFilter,
    /// What is kept beside the colour.
    pub aovs: AovSet,
    /// A factor on all light.
    pub gain: f32,
    /// Another seed gives another, independent image.
    pub seed: u64,
    /// Indices of the samples that are this render's part of the image.
    pub share: Range<u32>,
    /// When to stop.
    pub limits: Limits,
    /// Surface interactions after the first.
    pub max_bounces: u32,
    /// The bounce from which on Russian roulette goes by throughput; `None` leaves it to
    /// what a path may yet bring, or has plain paths play from the eighth.
    pub roulette_start: Option<u32>,
    /// Into how many branches a path splits at its first surface, on average over the
    /// pixels where they differ; 1 is plain path tracing, and `None` leaves it to what
    /// a branch costs.
    pub branches: Option<u32>,
    /// Use the kernel with every feature instead of the leanest that serves.
    pub all_in: bool,
}

impl RenderSettings {
    /// As the scene file says: the full image.
    #[must_use]
    pub fn new(description: &Description) -> Self {
        let (film, sampling) = (&description.film, &description.sampling);
        let resolution = [film.width, film.height];
        Self {
            resolution,
            window: Window::full(resolution),
            filter: match film.filter {
                Filter::Box {} => PixelFilter::box_filter(),
                Filter::BlackmanHarris { width } => PixelFilter::blackman_harris(width),
            },
            aovs: film
                .aovs
                .iter()
                .copied()
                .chain(film.transparent.then_some(Aov::Alpha))
                .collect(),
            gain: film.gain,
            seed: sampling.seed,
            share: 0..u32::MAX,
            limits: Limits::samples(sampling.spp),
            max_bounces: sampling.max_bounces,
            roulette_start: sampling.roulette_start,
            branches: sampling.branches,
            all_in: false,
        }
    }

    /// The most bytes that the film takes at once with what stands beside it: pilots of
    /// path splitting first, finished images at the end. Measured per pixel, by the
    /// peak of whole renders of 600² and 1200² pixels.
    #[must_use]
    pub fn memory(&self) -> u64 {
        const PILOTS: u64 = 204;
        const PILOTS_AOV: u64 = 51;
        const FINISHED: u64 = 158;
        const FINISHED_AOV: u64 = 79;
        let aovs = self.aovs.iter().count() as u64;
        let pilots = match self.branches {
            Some(1) => 0,
            _ => PILOTS + PILOTS_AOV * aovs,
        };
        self.window.area() as u64 * pilots.max(FINISHED + FINISHED_AOV * aovs)
    }

    /// An empty film for the window, which must lie within the image.
    #[must_use]
    pub fn film(&self) -> Film {
        let mut film = Film::new(self.resolution, self.window, self.aovs);
        film.set_share(self.share.clone());
        film
    }
}
