//! Light from an equirectangular image of the surroundings.

use super::select;
use super::{LightSample, Rgb};
use crate::color::luminance;
use crate::texture::EnvironmentImage;
use glam::{Mat3, Vec3};
use std::f32::consts::{FRAC_1_PI, PI, TAU};
use wide::f32x4;

/// The share of the mean luminance that light samples leave to BSDF samples.
/// Less than 1, so that an image of one colour keeps a density.
const LEFT_OUT: f64 = 0.5;

/// An equirectangular image that shines.
///
/// A world direction d is turned into d' = R·d and looked up at
/// u = 0.5 − atan2(d'_y, d'_x)/2π, v = 0.5 + asin(d'_z)/π, bilinearly between
/// texel centres, round the seam; v = 1 is the upper edge of the first row.
///
/// Directions are chosen by texel, in proportion to its solid angle times what
/// the mean luminance of the bilinear image over it exceeds `LEFT_OUT` of the
/// image's mean by, and uniformly in solid angle within it. What is darker has
/// density zero: BSDF samples find it, and have no rival there (MIS
/// compensation, Karlík, Šik, Vévoda, Skřivan and Křivánek 2019, "MIS
/// Compensation: Optimizing Sampling Techniques in Multiple Importance
/// Sampling", section 4).
#[derive(Clone, Debug)]
pub struct Environment {
    width: usize,
    height: usize,
    pixels: Vec<[f32; 3]>,
    scale: Rgb,
    to_image: Mat3,
    rows: select::Table,
    /// Running sums of the probabilities of the texels within each row.
    columns: Vec<f32>,
    /// Where to look in each row's sums.
    guides: Vec<u32>,
    /// sin of the elevation at the upper edge of each row, and below the last.
    sin_edges: Vec<f64>,
    /// The luminance of the irradiance of a surface averaged over orientations
    /// and counted on both sides: ∫ L dω / 2, W·m⁻².
    irradiance: f32,
}

impl Environment {
    /// `scale` makes a texel a radiance in W·m⁻²·sr⁻¹; `to_image` turns world
    /// directions into the image's. `None` when nothing shines.
    ///
    /// # Panics
    /// When the image has not as many pixels as it says.
    #[must_use]
    pub fn new(image: EnvironmentImage, scale: Rgb, to_image: Mat3) -> Option<Self> {
        let EnvironmentImage {
            width,
            height,
            pixels,
        } = image;
        assert_eq!(pixels.len(), width * height, "the image's size");
        let sin_edges: Vec<f64> = (0..=height)
            .map(|row| (std::f64::consts::PI * (0.5 - row as f64 / height as f64)).sin())
            .collect();

        let solid_angle =
            |y: usize| (sin_edges[y] - sin_edges[y + 1]) * std::f64::consts::TAU / width as f64;
        // The bound keeps sums finite.
        let shine =
            |x: usize, y: usize| luminance(Vec3::from(pixels[y * width + x]) * scale).min(1e30);
        let mut blurred = vec![0.0; width];
        let mut row = vec![0.0; width];
        let mut row_of = |y: usize, row: &mut [f64]| {
            let (above, below) = (y.saturating_sub(1), (y + 1).min(height - 1));
            for (x, value) in blurred.iter_mut().enumerate() {
                *value = mean_of_bilinear(shine(x, above), shine(x, y), shine(x, below));
            }
            for (x, mean) in row.iter_mut().enumerate() {
                let (left, right) = ((x + width - 1) % width, (x + 1) % width);
                *mean = mean_of_bilinear(blurred[left], blurred[x], blurred[right]).into();
            }
        };
        let mut total = 0.0;
        for y in 0..height {
            row_of(y, &mut row);
            total += row.iter().sum::<f64>() * solid_angle(y);
        }
        let left_out = LEFT_OUT * total / (4.0 * std::f64::consts::PI);
        let mut columns = Vec::with_capacity(width * height);
        let mut row_weights = Vec::with_capacity(height);
        for y in 0..height {
            row_of(y, &mut row);
            let above = row.iter().map(|mean| (mean - left_out).max(0.0));
            let sum = select::accumulate(above, &mut columns).unwrap_or(0.0);
            row_weights.push(sum * solid_angle(y));
        }
        let rows = select::Table::new(row_weights.into_iter())?;
        let mut guides = Vec::with_capacity(height * select::guide_length(width));
        for row in columns.chunks_exact(width) {
            select::guide_through(row, &mut guides);
        }
        Some(Self {
            width,
            height,
            pixels,
            scale,
            to_image,
            rows,
            columns,
            guides,
            sin_edges,
            irradiance: (total / 2.0) as f32,
        })
    }

    /// The radiance that comes from a unit direction, W·m⁻²·sr⁻¹.
    #[must_use]
    pub fn radiance(&self, direction: Vec3) -> Rgb {
        let (column, row) = self.raster(direction);
        self.bilinear(column, row)
    }

    /// What it takes, in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(self.pixels.as_slice())
            + size_of_val(self.columns.as_slice())
            + size_of_val(self.guides.as_slice())
            + self.rows.bytes()
            + size_of_val(self.sin_edges.as_slice())
    }

    pub(super) fn irradiance(&self) -> f32 {
        self.irradiance
    }

    /// The radiance from a direction and the density with which
    /// [`Environment::sample`] finds it, sr⁻¹, without the probability of
    /// choosing this light.
    pub(super) fn seen(&self, direction: Vec3) -> (Rgb, f32) {
        let (column, row) = self.raster(direction);
        let x = (column as usize).min(self.width - 1);
        let y = (row as usize).min(self.height - 1);
        let probability = self.rows.probability(y) * select::probability(self.row(y), x);
        (
            self.bilinear(column, row),
            probability * self.per_steradian(y),
        )
    }

    /// Samples a direction; `selection` is the probability with which this
    /// light was chosen.
    pub(super) fn sample(&self, selection: f32, u: [f32; 2]) -> LightSample {
        let (y, row_probability, in_row) = self.rows.sample(u[1]);
        let (x, texel_probability, in_texel) = select::sample(self.row(y), self.guide(y), u[0]);
        let column = x as f32 + in_texel;
        // In f64: next to the poles of a fine image, rows differ by less than
        // the sine's last digit in f32.
        let (upper, lower) = (self.sin_edges[y], self.sin_edges[y + 1]);
        let z = upper + (lower - upper) * f64::from(in_row);
        let horizontal = (1.0 - z * z).max(0.0).sqrt() as f32;
        let z = z as f32;
        let (sin, cos) = ((0.5 - column / self.width as f32) * TAU).sin_cos();
        let local = Vec3::new(horizontal * cos, horizontal * sin, z);
        let row = (0.5 - z.atan2(horizontal) * FRAC_1_PI) * self.height as f32;
        LightSample {
            direction: (self.to_image.transpose() * local).normalize(),
            distance: f32::INFINITY,
            radiance: self.bilinear(column, row),
            pdf: selection * row_probability * texel_probability * self.per_steradian(y),
            delta: false,
            surrounds: true,
            emitter: None,
        }
    }

    /// The running sums of a row.
    fn row(&self, y: usize) -> &[f32] {
        &self.columns[y * self.width..(y + 1) * self.width]
    }

    /// The guide through [`Environment::row`].
    fn guide(&self, y: usize) -> &[u32] {
        let length = select::guide_length(self.width);
        &self.guides[y * length..(y + 1) * length]
    }

    /// One over the solid angle of a texel of row `y`, sr⁻¹.
    fn per_steradian(&self, y: usize) -> f32 {
        let height = self.sin_edges[y] - self.sin_edges[y + 1];
        self.width as f32 / (TAU * height as f32)
    }

    /// Where a direction falls, in texels from the upper left corner.
    fn raster(&self, direction: Vec3) -> (f32, f32) {
        let d = self.to_image * direction;
        let across = (d.x * d.x + d.y * d.y).sqrt();
        // Azimuth and elevation at once; asin(z) would lose its digits next to the poles.
        let [azimuth, elevation, ..] = f32x4::new([d.y, d.z, 0.0, 0.0])
            .atan2(f32x4::new([d.x, across, 1.0, 1.0]))
            .to_array();
        (
            (0.5 - azimuth / TAU) * self.width as f32,
            (0.5 - elevation / PI) * self.height as f32,
        )
    }

    fn bilinear(&self, column: f32, row: f32) -> Rgb {
        let (x, y) = (column - 0.5, row - 0.5);
        let (x0, y0) = (x.floor(), y.floor());
        let (fx, fy) = (x - x0, y - y0);
        // A division of whole numbers takes as long as all the rest.
        let wrap = |x: i64| match usize::try_from(x) {
            Ok(x) if x < self.width => x,
            _ => x.rem_euclid(self.width as i64) as usize,
        };
        let clamp = |y: i64| y.clamp(0, self.height as i64 - 1) as usize;
        let (left, right) = (wrap(x0 as i64), wrap(x0 as i64 + 1));
        let (upper, lower) = (clamp(y0 as i64), clamp(y0 as i64 + 1));
        let texel = |x: usize, y: usize| Vec3::from(self.pixels[y * self.width + x]);
        let mix = |y: usize| texel(left, y).lerp(texel(right, y), fx);
        mix(upper).lerp(mix(lower), fy) * self.scale
    }
}

/// The mean over a texel's width of the linear interpolation between its own
/// value and its neighbours'.
fn mean_of_bilinear(before: f32, own: f32, after: f32) -> f32 {
    0.75 * own + 0.125 * (before + after)
}
