//! Renders, and the error after each doubling of samples.

use std::time::Duration;

use cpu_time::ProcessTime;
use serde::Serialize;

use super::Run;
use crate::film::{AovSet, Film};
use crate::image::{Image, Window};
use crate::integrator::{Control, RenderError, render};
use crate::metrics::{REL_EPSILON, noise_floor, rel_mse_trimmed};
use crate::scene::{Limits, RenderSettings, Scene};

/// What is rendered: all of a scene's image, its colour alone.
#[derive(Clone, Debug)]
pub struct View<'a> {
    scene: &'a Scene,
    settings: RenderSettings,
}

impl<'a> View<'a> {
    /// Of a scene with these settings.
    ///
    /// # Errors
    /// When the scene has no camera.
    pub fn new(scene: &'a Scene, settings: &RenderSettings) -> Result<Self, RenderError> {
        if scene.camera.is_none() {
            return Err(RenderError::NoCamera);
        }
        let settings = RenderSettings {
            window: Window::full(settings.resolution),
            aovs: AovSet::NONE,
            ..settings.clone()
        };
        Ok(Self { scene, settings })
    }

    /// Width and height in pixels.
    #[must_use]
    pub fn resolution(&self) -> [u32; 2] {
        self.settings.resolution
    }

    /// An empty film for it.
    #[must_use]
    pub fn film(&self) -> Film {
        self.settings.film()
    }

    /// Renders on until `film` has `spp` samples per pixel; returns wall-clock
    /// and CPU time.
    pub fn render(&self, film: &mut Film, seed: u64, spp: u32) -> (Duration, Duration) {
        let settings = RenderSettings {
            seed,
            limits: Limits::samples(spp),
            ..self.settings.clone()
        };
        let cpu = ProcessTime::now();
        let report = render(self.scene, &settings, film, Control::default());
        let wall = report.expect("the scene has a camera").wall;
        (wall, cpu.elapsed())
    }
}

/// Why an image can't serve as a reference.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
pub enum ReferenceError {
    /// It is of another size, or a crop.
    #[error(
        "the reference covers {} × {} pixels; the scene's image has {} × {}",
        found[0], found[1], expected[0], expected[1]
    )]
    Size {
        /// What it covers, in pixels.
        found: [u32; 2],
        /// What the scene has, in pixels.
        expected: [u32; 2],
    },
    /// Errors against it would be NaN.
    #[error("{0} pixels of the reference are not finite")]
    NotFinite(usize),
    /// Its noise would be that of the measured images in part.
    #[error("the reference was rendered with seed {0}, which is among the measured ones")]
    SameSeed(u64),
}

/// What images are compared with.
#[derive(Clone, Debug)]
pub struct Reference {
    color: Vec<[f32; 3]>,
    /// The relative mean squared error that its noise adds to that of any
    /// image, where it is known.
    pub floor: Option<f64>,
}

impl Reference {
    /// The mean of two independent renders of half the samples each, with the
    /// seeds `seed` and `seed` + 1. For these, A and B, the square of A − (A +
    /// B)/2 has the variance of their mean for its expectation, whatever the
    /// sampler's stratification.
    #[must_use]
    pub fn render(view: &View<'_>, spp: u32, seed: u64) -> Self {
        let half = |seed| {
            let mut film = view.film();
            view.render(&mut film, seed, spp.div_ceil(2));
            film.develop().color
        };
        let (a, b) = (half(seed), half(seed.wrapping_add(1)));
        let color: Vec<[f32; 3]> = a
            .iter()
            .zip(&b)
            .map(|(a, b)| std::array::from_fn(|c| 0.5 * (a[c] + b[c])))
            .collect();
        let floor = Some(rel_mse_trimmed(&a, &color));
        Self { color, floor }
    }

    /// An image from elsewhere, to be compared with renders of the given
    /// resolution and seeds. The floor comes from its layer `variance`, if it
    /// has one.
    ///
    /// # Errors
    /// When it does not fit, is not finite, or shares a seed.
    pub fn from_image(
        image: &Image,
        resolution: [u32; 2],
        seeds: &[u64],
    ) -> Result<Self, ReferenceError> {
        if image.window != Window::full(resolution) {
            return Err(ReferenceError::Size {
                found: [image.window.width, image.window.height],
                expected: resolution,
            });
        }
        let finite = |color: &[f32; 3]| color.iter().all(|c| c.is_finite());
        let bad = image.color.iter().filter(|color| !finite(color)).count();
        if bad > 0 {
            return Err(ReferenceError::NotFinite(bad));
        }
        let attribute = image.attributes.iter().find(|(k, _)| k == "smithwalk.seed");
        let seed = attribute.and_then(|(_, value)| value.parse().ok());
        if let Some(seed) = seed.filter(|seed| seeds.contains(seed)) {
            return Err(ReferenceError::SameSeed(seed));
        }
        let variance = image.layer("variance").and_then(crate::image::Layer::rgb);
        Ok(Self {
            color: image.color.clone(),
            floor: variance.map(|variance| noise_floor(&image.color, &variance)),
        })
    }

    /// The error of `image`, the reference's own noise subtracted.
    #[must_use]
    pub fn rel_mse(&self, image: &[[f32; 3]]) -> f64 {
        rel_mse_trimmed(image, &self.color) - self.floor.unwrap_or(0.0)
    }

    /// The systematic error of another reference against this one, the noise
    /// of both subtracted.
    #[must_use]
    pub fn bias(&self, other: &Self) -> f64 {
        self.rel_mse(&other.color) - other.floor.unwrap_or(0.0)
    }
}

/// How far to go.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The last number of samples per pixel; the others are all powers of two
    /// below it.
    pub spp: u32,
    /// One series of images for each.
    pub seeds: Vec<u64>,
}

impl Plan {
    /// The numbers of samples per pixel that errors are measured at.
    pub fn levels(&self) -> impl Iterator<Item = u32> + use<> {
        let last = self.spp;
        (0..u32::BITS)
            .map(|bit| 1 << bit)
            .take_while(move |&spp| spp < last)
            .chain([last])
    }
}

/// How heavy the tails of single samples are: of (x − b)/√(b² + ε), with x the
/// estimate of a pixel's channel from one sample and b the reference, pooled
/// over pixels, channels and seeds. No values are left out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Tails {
    /// Values pooled.
    pub values: u64,
    /// Mean square, which a relative mean squared error at one sample is.
    pub variance: f64,
    /// Mean fourth power over the square of the variance; 3 for a normal
    /// distribution.
    pub kurtosis: f64,
    /// The largest value, in standard deviations.
    pub largest: f64,
}

/// Sums for [`Tails`].
#[derive(Default)]
struct TailSums {
    values: u64,
    squares: f64,
    fourth: f64,
    largest: f64,
}

impl TailSums {
    fn add(&mut self, image: &[[f32; 3]], reference: &[[f32; 3]]) {
        let values = image.as_flattened().iter().zip(reference.as_flattened());
        for (&x, &b) in values {
            let (x, b) = (f64::from(x), f64::from(b));
            let square = (x - b) * (x - b) / (b * b + REL_EPSILON);
            self.values += 1;
            self.squares += square;
            self.fourth += square * square;
            self.largest = self.largest.max(square);
        }
    }

    fn finish(&self) -> Tails {
        let n = self.values as f64;
        let variance = self.squares / n;
        Tails {
            values: self.values,
            variance,
            kurtosis: self.fourth / n / (variance * variance),
            largest: (self.largest / variance).sqrt(),
        }
    }
}

/// Renders `view` once for each seed, and measures its error at every level of
/// the plan on the way. Times are those of rendering alone, summed up.
pub fn measure(
    name: &str,
    view: &View<'_>,
    reference: &Reference,
    plan: &Plan,
) -> (Vec<Run>, Tails) {
    let mut runs = Vec::new();
    let mut tails = TailSums::default();
    for &seed in &plan.seeds {
        let mut film = view.film();
        let (mut wall, mut cpu) = (Duration::ZERO, Duration::ZERO);
        for spp in plan.levels() {
            let added = view.render(&mut film, seed, spp);
            wall += added.0;
            cpu += added.1;
            let color = film.develop().color;
            if spp == 1 {
                tails.add(&color, &reference.color);
            }
            runs.push(Run {
                name: name.to_owned(),
                spp,
                seed: Some(seed),
                wall_s: wall.as_secs_f64(),
                cpu_s: cpu.as_secs_f64(),
                rel_mse: reference.rel_mse(&color),
            });
        }
    }
    (runs, tails.finish())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Layer;

    fn image(value: f32) -> Image {
        let mut image = Image::black([8, 4], Window::full([8, 4]));
        image.color.fill([value; 3]);
        image
    }

    #[test]
    fn levels_are_powers_of_two_and_the_last() {
        let levels = |spp| {
            let plan = Plan { spp, seeds: vec![] };
            plan.levels().collect::<Vec<_>>()
        };
        assert_eq!(levels(1), [1]);
        assert_eq!(levels(8), [1, 2, 4, 8]);
        assert_eq!(levels(11), [1, 2, 4, 8, 11]);
    }

    /// Three values off by 1 and one by 3, all relative to √(1 + ε).
    #[test]
    fn tails_by_hand() {
        let mut sums = TailSums::default();
        let b = [[1.0; 3], [1.0; 3]];
        sums.add(&[[2.0, 0.0, 2.0], [4.0, 1.0, 1.0]], &b);
        let tails = sums.finish();
        let (second, fourth) = (12.0 / 6.0, 84.0 / 6.0);
        assert_eq!(tails.values, 6);
        assert!((tails.variance - second / 1.01).abs() < 1e-12);
        assert!((tails.kurtosis - fourth / (second * second)).abs() < 1e-12);
        assert!((tails.largest - (9.0_f64 / second).sqrt()).abs() < 1e-12);
    }

    #[test]
    fn a_reference_knows_its_floor_and_its_faults() {
        let mut with_variance = image(1.0);
        let mut layer = Layer::black("variance", &["R", "G", "B"], 32);
        layer.planes.iter_mut().for_each(|plane| plane.fill(0.0202));
        with_variance.layers.push(layer);
        let reference = Reference::from_image(&with_variance, [8, 4], &[1]).unwrap();
        assert!((reference.floor.unwrap() - 0.02).abs() < 1e-6);
        // (1.2 − 1)²/1.01 − 0.02
        let error = reference.rel_mse(&image(1.2).color);
        assert!((error - (0.04 / 1.01 - 0.02)).abs() < 1e-6, "{error}");

        let plain = Reference::from_image(&image(1.0), [8, 4], &[]).unwrap();
        assert_eq!(plain.floor, None);
        let size = Reference::from_image(&image(1.0), [8, 8], &[]).unwrap_err();
        assert!(matches!(size, ReferenceError::Size { .. }));
        let mut bad = image(1.0);
        bad.color[3][1] = f32::NAN;
        let bad = Reference::from_image(&bad, [8, 4], &[]).unwrap_err();
        assert_eq!(bad, ReferenceError::NotFinite(1));
        let mut seeded = image(1.0);
        let attribute = ("smithwalk.seed".to_owned(), "3".to_owned());
        seeded.attributes.push(attribute);
        let seeded = Reference::from_image(&seeded, [8, 4], &[2, 3]).unwrap_err();
        assert_eq!(seeded, ReferenceError::SameSeed(3));
    }
}
