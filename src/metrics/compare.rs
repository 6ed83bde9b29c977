//! All figures at once, for images from files.

use crate::image::{Image, Window};

use super::ztest::guard_variance;
use super::{
    DifferenceMap, Outliers, Precision, ZTest, flip, mean, mse, outliers, rel_bias,
    rel_bias_trimmed, rel_mse, rel_mse_trimmed, relative_difference_map, z_map, z_test,
};

/// Why two images can't be compared.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    /// They are not of one size.
    #[error("the images differ in size: {} × {} and {} × {} pixels", a[0], a[1], b[0], b[1])]
    Size {
        /// Width and height of the first.
        a: [u32; 2],
        /// Width and height of the second.
        b: [u32; 2],
    },
    /// They are crops without a common pixel.
    #[error("the images are crops that don't overlap: {a:?} and {b:?}")]
    NoOverlap {
        /// What the first one covers.
        a: Window,
        /// What the second one covers.
        b: Window,
    },
    /// No pixel of both is finite.
    #[error("no pixel is finite in both images")]
    NothingFinite,
    /// z-scores were asked for without variances.
    #[error("neither image has a layer called variance; render one with that AOV")]
    NoVariance,
}

/// How image A differs from its reference B.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Comparison {
    /// Columns compared.
    pub width: u32,
    /// Rows compared.
    pub height: u32,
    /// Pixels with an infinity or NaN in either image, left out of all figures
    /// but `flip`, which takes them for white or black.
    pub non_finite_pixels: usize,
    /// Mean radiance of A per channel.
    pub mean_a: [f64; 3],
    /// Mean radiance of B per channel.
    pub mean_b: [f64; 3],
    /// See [`rel_bias`].
    pub rel_bias: f64,
    /// See [`rel_bias_trimmed`].
    pub rel_bias_trimmed: f64,
    /// The relative bias of each channel; null for a channel without light.
    pub rel_bias_rgb: [f64; 3],
    /// See [`mse`].
    pub mse: f64,
    /// Root of `mse`, in radiance.
    pub rmse: f64,
    /// See [`rel_mse`].
    pub rel_mse: f64,
    /// See [`rel_mse_trimmed`].
    pub rel_mse_trimmed: f64,
    /// See [`Outliers`].
    #[serde(flatten)]
    pub outliers: Outliers,
    /// See [`flip()`].
    pub flip: f32,
    /// Filled in when asked for.
    #[serde(flatten)]
    pub z: Option<ZTest>,
}

/// An image and its reference, cut to the pixels that both have.
#[derive(Clone, Debug)]
pub struct Pair {
    a: Image,
    b: Image,
    /// Sum of the variances of those that have a layer of that name, guarded
    /// against events that a pixel has not seen.
    variance: Option<Vec<[f64; 3]>>,
}

impl Pair {
    /// Pairs an image with its reference. Crops of one image may differ; an
    /// image without a layer called `variance` is taken as exact.
    ///
    /// # Errors
    /// When the images differ in size or are crops without a common pixel.
    pub fn new(a: &Image, b: &Image) -> Result<Self, CompareError> {
        // Two crops of equal size from images of different size are still no
        // views of the same picture.
        if a.resolution != b.resolution {
            let (a, b) = (a.resolution, b.resolution);
            return Err(CompareError::Size { a, b });
        }
        let window = a
            .window
            .intersect(b.window)
            .ok_or(CompareError::NoOverlap {
                a: a.window,
                b: b.window,
            })?;
        let (a, b) = (a.crop(window), b.crop(window));
        let layer = |image: &Image| image.layer("variance").and_then(crate::image::Layer::rgb);
        let mut variance = None;
        for layer in [layer(&a), layer(&b)].into_iter().flatten() {
            let sum: &mut Vec<[f64; 3]> =
                variance.get_or_insert_with(|| vec![[0.0; 3]; window.area()]);
            for (sum, value) in sum.iter_mut().zip(guard_variance(window, &layer)) {
                *sum = [0, 1, 2].map(|c| sum[c] + value[c]);
            }
        }
        Ok(Self { a, b, variance })
    }

    /// Image and reference, cut to what both have.
    #[must_use]
    pub fn images(&self) -> [&Image; 2] {
        [&self.a, &self.b]
    }

    /// The pixels that are compared.
    pub fn window(&self) -> Window {
        self.a.window
    }

    /// All figures but the z-tests. `exposure`, in stops, is for the eye alone,
    /// hence for `flip`.
    ///
    /// # Errors
    /// When no pixel is finite in both images.
    pub fn compare(&self, exposure: f32) -> Result<Comparison, CompareError> {
        let finite = |color: &[f32; 3]| color.iter().all(|c| c.is_finite());
        let pixels = self.a.color.iter().zip(&self.b.color);
        let (a, b): (Vec<_>, Vec<_>) = pixels.filter(|(a, b)| finite(a) && finite(b)).unzip();
        if a.is_empty() {
            return Err(CompareError::NothingFinite);
        }
        let (mean_a, mean_b) = (mean(&a), mean(&b));
        let mse = mse(&a, &b);
        Ok(Comparison {
            width: self.a.window.width,
            height: self.a.window.height,
            non_finite_pixels: self.a.color.len() - a.len(),
            mean_a,
            mean_b,
            rel_bias: rel_bias(&a, &b),
            rel_bias_trimmed: rel_bias_trimmed(&a, &b),
            rel_bias_rgb: [0, 1, 2].map(|c| mean_a[c] / mean_b[c] - 1.0),
            mse,
            rmse: mse.sqrt(),
            rel_mse: rel_mse(&a, &b),
            rel_mse_trimmed: rel_mse_trimmed(&a, &b),
            outliers: outliers(&a, &b),
            flip: flip(&self.a, &self.b, exposure),
            z: None,
        })
    }

    /// The z-tests, see [`ZTest`].
    ///
    /// # Errors
    /// When neither image knows its variance.
    pub fn z_test(&self) -> Result<ZTest, CompareError> {
        let variance = self.variance.as_ref().ok_or(CompareError::NoVariance)?;
        let window = self.window();
        Ok(z_test(
            window,
            &self.a.color,
            &self.b.color,
            variance,
            self.precision(),
        ))
    }

    fn precision(&self) -> Precision {
        if self.a.half || self.b.half {
            Precision::Half
        } else {
            Precision::Full
        }
    }

    /// Relative differences as colours.
    pub fn difference_map(&self) -> DifferenceMap {
        relative_difference_map(&self.a.color, &self.b.color)
    }

    /// z-scores as colours.
    ///
    /// # Errors
    /// When neither image knows its variance.
    pub fn z_map(&self) -> Result<DifferenceMap, CompareError> {
        let variance = self.variance.as_ref().ok_or(CompareError::NoVariance)?;
        Ok(z_map(
            &self.a.color,
            &self.b.color,
            variance,
            self.precision(),
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Layer;

    fn image(value: f32) -> Image {
        let mut image = Image::black([20, 10], Window::full([20, 10]));
        image.color.fill([value; 3]);
        image
    }

    fn with_variance(mut image: Image, value: f32) -> Image {
        let mut layer = Layer::black("variance", &["R", "G", "B"], image.color.len());
        layer.planes.iter_mut().for_each(|plane| plane.fill(value));
        image.layers.push(layer);
        image
    }

    #[test]
    fn variances_of_both_images_add_up() {
        let test = |a: Image, b: Image| Pair::new(&a, &b).unwrap().z_test();
        let noisy = |value| with_variance(image(value), 0.04);
        let one = test(noisy(1.2), image(1.0)).unwrap();
        assert!((one.z_max - 1.0).abs() < 1e-4, "{one:?}");
        let two = test(noisy(1.2), noisy(1.0)).unwrap();
        assert!((two.z_max - 0.5_f64.sqrt()).abs() < 1e-4, "{two:?}");
        let none = test(image(1.2), image(1.0)).unwrap_err();
        assert!(matches!(none, CompareError::NoVariance));
    }

    /// 0.3 in half floats is off by 7e-5: no difference in a file of halves, and
    /// plain to see in one of floats.
    #[test]
    fn the_rounding_of_half_floats_is_no_difference() {
        let exact = with_variance(image(0.3), 0.0);
        let mut rounded = image(0.299_926_76);
        let test = |b: &Image| Pair::new(&exact, b).unwrap().z_test().unwrap();
        assert!(!test(&rounded).passed());
        rounded.half = true;
        assert!(test(&rounded).passed());
        rounded.color[7][1] = 0.3 * 1.01;
        assert_eq!(test(&rounded).z_failed_pixels, 1);
    }

    #[test]
    fn crops_are_compared_where_they_overlap() {
        let whole = image(1.0);
        let part = Window {
            x: 4,
            y: 2,
            width: 6,
            height: 5,
        };
        let mut crop = image(1.1).crop(part);
        let pair = Pair::new(&crop, &whole).unwrap();
        assert_eq!(pair.window(), part);
        let found = pair.compare(0.0).unwrap();
        assert!((found.rel_bias - 0.1).abs() < 1e-6);
        crop.window.x = 14;
        let other = whole.crop(part);
        let error = Pair::new(&crop, &other).unwrap_err();
        assert!(matches!(error, CompareError::NoOverlap { .. }));
        let error = Pair::new(&Image::black([20, 9], Window::full([20, 9])), &whole);
        assert!(matches!(error, Err(CompareError::Size { .. })));
    }

    #[test]
    fn pixels_that_are_not_finite_are_counted_and_left_out() {
        let mut a = image(1.0);
        a.color[3][1] = f32::NAN;
        let mut b = image(1.0);
        b.color[5][0] = f32::INFINITY;
        let found = Pair::new(&a, &b).unwrap().compare(0.0).unwrap();
        assert_eq!(found.non_finite_pixels, 2);
        assert_eq!((found.rel_mse, found.rel_bias), (0.0, 0.0));
        a.color.fill([f32::NAN; 3]);
        let nothing = Pair::new(&a, &b).unwrap().compare(0.0);
        assert!(matches!(nothing, Err(CompareError::NothingFinite)));
    }
}
