//! What a person sees of a difference.

use crate::image::{Display, Image};

/// Mean of the ꟻLIP error map (Andersson et al. 2020, "FLIP: A Difference
/// Evaluator for Alternating Images", Proc. ACM CGIT 3(2)), between 0 (nobody
/// sees a difference) and 1.
///
/// Both images are first turned into 8-bit sRGB, scaled by 2^`exposure`; they
/// are looked at as the paper assumes, with 67 pixels per degree (0.7 m from a
/// 4k monitor 0.7 m wide).
///
/// # Panics
/// If the images differ in size.
pub fn flip(a: &Image, b: &Image, exposure: f32) -> f32 {
    let size = |image: &Image| [image.window.width, image.window.height];
    assert_eq!(size(a), size(b), "images of different size");
    let [width, height] = size(a);
    let convert = |image: &Image| {
        let pixels = Display::srgb(exposure).encode(image);
        nv_flip::FlipImageRgb8::with_data(width, height, &pixels)
    };
    let errors = nv_flip::flip(convert(b), convert(a), nv_flip::DEFAULT_PIXELS_PER_DEGREE);
    nv_flip::FlipPool::from_image(&errors).mean()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Window;

    fn grey(value: f32) -> Image {
        let mut image = Image::black([32, 32], Window::full([32, 32]));
        image.color.fill([value; 3]);
        image
    }

    #[test]
    fn flip_grows_with_the_visible_difference() {
        let reference = grey(0.2);
        assert_eq!(flip(&reference, &reference, 0.0), 0.0);
        let [near, far] = [0.22, 0.4].map(|value| flip(&grey(value), &reference, 0.0));
        assert!(0.0 < near && near < far && far < 1.0, "{near} {far}");
        // Black against white is the largest difference there is.
        let most = flip(&grey(1.0), &grey(0.0), 0.0);
        assert!(most > 0.9, "{most}");
    }
}
