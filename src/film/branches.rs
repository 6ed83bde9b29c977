//! Into how many branches the paths of a pixel split, by how noisy it is.

use super::{Film, Window};

/// No pixel gets more than this many times the mean.
const MOST: f64 = 4.0;

/// Radius in pixels of the square over which noise is averaged: a few samples
/// of one pixel say little about its own.
const RADIUS: u32 = 3;

impl Film {
    /// Decides how many branches the paths of each pixel have from now on,
    /// `mean` on average over the pixels that are noisy at all: in proportion to
    /// the relative standard deviation of a sample, which is what makes the most
    /// of a given number of branches (Neyman 1934, optimal allocation).
    ///
    /// However they are chosen, each sample's expectation is the pixel's value, so
    /// the image has no bias; what a pixel gets is decided by its neighbours'
    /// samples alone, as its own are points of one sequence and not independent.
    pub fn plan_branches(&mut self, mean: u32) {
        let window = self.window;
        let mut noise = vec![0.0; window.area()];
        for tile in &self.tiles {
            for pixel in tile.window().pixels() {
                noise[window.index(pixel)] = tile.relative_variance(pixel);
            }
        }
        let deviations = neighbours(window, &noise).map(f64::sqrt);
        let deviations: Vec<f64> = deviations.collect();
        let noisy = deviations.iter().filter(|&&d| d > 0.0).count();
        let scale = f64::from(mean) * noisy as f64 / deviations.iter().sum::<f64>();
        // A mean of one asks for plain paths.
        let most = if mean > 1 {
            MOST * f64::from(mean)
        } else {
            1.0
        };
        for tile in &mut self.tiles {
            for pixel in tile.window().pixels() {
                let share = scale * deviations[window.index(pixel)];
                // Without noise anywhere the scale is no number: one branch.
                let branches = share.max(1.0).min(most).round() as u32;
                tile.set_branches(pixel, branches);
            }
        }
    }
}

/// For each pixel of `window`, the mean of `values` over those round it, itself
/// left out; 0 where there are none.
fn neighbours(window: Window, values: &[f64]) -> impl Iterator<Item = f64> {
    window.pixels().map(move |[x, y]| {
        let low = [x.saturating_sub(RADIUS), y.saturating_sub(RADIUS)];
        let square = Window {
            x: low[0],
            y: low[1],
            width: x + RADIUS + 1 - low[0],
            height: y + RADIUS + 1 - low[1],
        };
        let (mut sum, mut count) = (0.0, 0);
        for pixel in square
            .intersect(window)
            .into_iter()
            .flat_map(|s| s.pixels())
        {
            if pixel != [x, y] {
                sum += values[window.index(pixel)];
                count += 1;
            }
        }
        if count > 0 {
            sum / f64::from(count)
        } else {
            0.0
        }
    })
}

#[cfg(test)]
mod tests {
    use crate::film::{AovSet, Film, Sample, Window};

    /// A film whose right half alternates between 0 and 2 and whose left is flat.
    fn half_noisy(mean: u32) -> Film {
        let mut film = Film::new([32, 32], Window::full([32, 32]), AovSet::NONE);
        for tile in film.tiles_mut() {
            for pixel in tile.window().pixels() {
                for index in 0..4 {
                    let noise = if pixel[0] < 16 { 1 } else { 2 * (index % 2) };
                    let color = [noise as f32; 3];
                    tile.add(
                        pixel,
                        &Sample {
                            color,
                            ..Sample::default()
                        },
                    );
                }
            }
        }
        film.plan_branches(mean);
        film
    }

    fn branches(film: &mut Film, pixel: [u32; 2]) -> u32 {
        film.tiles_mut()
            .iter()
            .find(|tile| tile.window().pixels().any(|p| p == pixel))
            .map_or(0, |tile| tile.branches(pixel))
    }

    #[test]
    fn noisy_pixels_get_more() {
        let mut film = half_noisy(4);
        assert_eq!(branches(&mut film, [2, 8]), 1);
        let noisy = branches(&mut film, [28, 8]);
        assert!((4..=5).contains(&noisy), "{noisy}");
        // Neighbours of noise count as noisy, and the other way round.
        let edge = branches(&mut film, [15, 8]);
        assert!(edge > 1 && edge < noisy, "{edge}");
    }

    #[test]
    fn one_on_average_is_one_for_all() {
        let mut film = half_noisy(1);
        assert!([[2, 8], [15, 8], [28, 8]].map(|p| branches(&mut film, p)) == [1; 3]);
    }

    #[test]
    fn a_flat_image_needs_no_branches() {
        let mut film = Film::new([1, 1], Window::full([1, 1]), AovSet::NONE);
        film.plan_branches(4);
        assert_eq!(branches(&mut film, [0, 0]), 1);
    }
}
