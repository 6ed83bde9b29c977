//! How noisy the image is estimated to be.

use super::Film;

/// Keeps dark pixels from dominating, as in [`crate::metrics`]: relative errors
/// count where radiance is well above √ε = 0.1.
const EPSILON: f64 = crate::metrics::REL_EPSILON;

impl Film {
    /// Estimated relative error of the image, the root of the expected relMSE:
    ///
    /// √( mean over pixels and channels of Var\[mean\] / (mean² + ε) ),
    ///
    /// with ε = 0.01 and the worst 0.1 % of pixels left out, as
    /// [`crate::metrics::rel_mse_trimmed`] does, so that a single firefly does
    /// not decide. Errs on the large side, as [`super::FilmTile::variance`]
    /// does. `None` while a pixel has fewer than two samples.
    pub fn relative_error(&self) -> Option<f64> {
        let mut terms = Vec::with_capacity(self.window.area());
        for tile in &self.tiles {
            if tile.colors.iter().any(|color| color.count < 2) {
                return None;
            }
            for pixel in tile.window().pixels() {
                let relative = tile
                    .color(pixel)
                    .into_iter()
                    .zip(tile.variance(pixel))
                    .map(|(mean, variance)| variance / (mean * mean + EPSILON));
                terms.push(relative.sum::<f64>() / 3.0);
            }
        }
        Some(crate::metrics::trimmed_mean(&mut terms).sqrt())
    }
}
