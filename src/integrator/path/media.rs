//! What a path is inside of, and what is left of light that crosses it.

use crate::color::Rgb;
use crate::scene::{Scene, Surface};

/// The objects that a path is inside of, by Beer and Lambert's law. Where several fill
/// the same space, all of them absorb. Most paths are inside of none, and carry no more
/// than that.
#[derive(Clone, Default)]
pub(super) struct Media(Option<Box<Filled>>);

/// At least one object.
#[derive(Clone, Default)]
struct Filled {
    /// Objects with their absorption, m⁻¹, in the order in which they were entered.
    inside: Vec<(usize, Rgb)>,
    /// The sum of all, m⁻¹.
    absorption: Rgb,
}

impl Media {
    /// Whether nothing absorbs.
    pub fn is_empty(&self) -> bool {
        self.0.is_none()
    }

    /// Goes through `surface` from the side that it is seen from.
    pub fn cross(&mut self, scene: &Scene, surface: &Surface) {
        let Some(absorption) = scene.materials[surface.material].interior else {
            return;
        };
        let mut filled = self.0.take().unwrap_or_default();
        if surface.front {
            filled.inside.push((surface.object, absorption));
        } else {
            // A path that began inside has not entered.
            let entered = |&(object, _): &(usize, Rgb)| object == surface.object;
            if let Some(last) = filled.inside.iter().rposition(entered) {
                filled.inside.remove(last);
            }
        }
        if !filled.inside.is_empty() {
            filled.absorption = filled
                .inside
                .iter()
                .map(|&(_, absorption)| absorption)
                .sum();
            self.0 = Some(filled);
        }
    }

    /// The share of light that is left after `distance` metres, which may be infinite.
    pub fn transmittance(&self, distance: f32) -> Rgb {
        let Some(filled) = &self.0 else {
            return Rgb::ONE;
        };
        filled.absorption.map(|absorption| {
            // Infinity times 0 is not a number.
            if absorption > 0.0 {
                (-absorption * distance).exp()
            } else {
                1.0
            }
        })
    }
}
