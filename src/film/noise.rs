//! How noisy the image is estimated to be.

use super::Film;

/// Keeps dark pixels from dominating, as in [`crate::metrics`]: relative errors
/// count where radiance is well above √ε = 0.1.
const EPSILON: f64 = crate::metrics::REL_EPSILON;

impl Film {
    /// Estimated relative error of the image, the root of the expected relMSE:
    ///
    /// √( mean over pixels and channels of V / (mean² + ε) ),
    ///
    /// with ε = 0.01 and the worst 0.1 % of pixels left out, as
    /// [`crate::metrics::rel_mse_trimmed`] does, so that a single firefly does
    /// not decide. V comes from how the pixel's means over two halves of the samples
    /// differ, up to the last power of two of the sample index; it counts in what
    /// stratification gains within a half, which the sample variance can't. As it misses
    /// what the halves gain together, it errs on the large side: by √(2^(1+a) − 1) where
    /// the variance falls as n^(−1−a), a between 0 (independent samples) and 2. `None`
    /// while a half is empty.
    pub fn relative_error(&self) -> Option<f64> {
        let mut terms = Vec::with_capacity(self.window.area());
        for tile in &self.tiles {
            for pixel in tile.window().pixels() {
                let relative = tile
                    .color(pixel)
                    .into_iter()
                    .zip(tile.halves_variance(pixel)?)
                    .map(|(mean, variance)| variance / (mean * mean + EPSILON));
                terms.push(relative.sum::<f64>() / 3.0);
            }
        }
        Some(crate::metrics::trimmed_mean(&mut terms).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use crate::film::{AovSet, Film, Sample};
    use crate::image::Window;
    use crate::sampler::{Dimension, Sampler};

    const SIDE: u32 = 128;
    const SPP: u32 = 64;

    /// The estimate for an image of `integrand`, and the true error, given the
    /// integral over the unit square.
    fn errors(integrand: fn([f32; 2]) -> f32, integral: f64, sobol: bool) -> [f64; 2] {
        let window = Window::full([SIDE, SIDE]);
        let mut film = Film::new([SIDE, SIDE], window, AovSet::NONE);
        for tile in film.tiles_mut() {
            for index in 0..SPP {
                // Another seed for each sample makes them independent.
                let (seed, index) = if sobol { (0, index) } else { (index.into(), 0) };
                for pixel in tile.window().pixels() {
                    let u = Sampler::new(seed, pixel, index).get_2d(Dimension::lens());
                    tile.add(pixel, &[Sample::of([integrand(u); 3])]);
                }
                tile.advance();
            }
        }
        let exact = vec![[integral as f32; 3]; window.area()];
        let error = crate::metrics::rel_mse_trimmed(&film.develop().color, &exact);
        [film.relative_error().unwrap(), error.sqrt()]
    }

    /// Over 16384 pixels of one degree of freedom, estimate and error each have
    /// a relative σ of 0.55 %, their ratio 0.8 %; the bound of 4 % is 5 σ.
    #[test]
    fn the_error_of_independent_samples_is_met() {
        let [estimate, error] = errors(|u| 1.0 + u[0] * u[1], 1.25, false);
        assert!((estimate / error - 1.0).abs() < 0.04, "{estimate} {error}");
    }

    /// With a disk, discontinuous, and with a smooth product.
    #[test]
    fn the_error_of_stratified_samples_is_not_underrated() {
        let disk = |u: [f32; 2]| {
            let inside = u[0] * u[0] + u[1] * u[1] < 1.0;
            if inside { 1.5 } else { 0.5 }
        };
        let smooth = |u: [f32; 2]| 1.0 + u[0] * u[1];
        let disk_integral = 0.5 + std::f64::consts::FRAC_PI_4;
        let check = |name: &str, integrand, integral| {
            let [estimate, error] = errors(integrand, integral, true);
            let independent = errors(integrand, integral, false)[1];
            let ratio = estimate / error;
            // √(2² − 1) = 1.73 for a = 1, √7 = 2.65 for a = 2.
            assert!((0.96..2.75).contains(&ratio), "{name}: {estimate} {error}");
            // Stratification gains 2.6 and 21; the sample variance sees none of it.
            assert!(estimate < independent / 1.5, "{name}: sees the gain");
        };
        check("disk", disk, disk_integral);
        check("smooth", smooth, 1.25);
    }

    #[test]
    fn one_sample_says_nothing() {
        let mut film = Film::new([1, 1], Window::full([1, 1]), AovSet::NONE);
        assert_eq!(film.relative_error(), None);
        let add = |film: &mut Film| {
            film.tiles_mut()[0].add([0, 0], &[Sample::default()]);
            film.tiles_mut()[0].advance();
        };
        add(&mut film);
        assert_eq!(film.relative_error(), None);
        add(&mut film);
        assert_eq!(film.relative_error(), Some(0.0));
    }
}
