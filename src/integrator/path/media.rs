//! What a path is inside of, and what is left of light that crosses it.

use smallvec::SmallVec;

use crate::color::Rgb;
use crate::scene::{Scene, Surface};

/// The objects that a path is inside of, by Beer and Lambert's law. Where several fill
/// the same space, all of them absorb.
#[derive(Clone, Default)]
pub(super) struct Media {
    /// Objects with their absorption, m⁻¹, in the order in which they were entered.
    inside: SmallVec<[(usize, Rgb); 1]>,
    /// The sum of all, m⁻¹.
    absorption: Rgb,
}

impl Media {
    /// Whether nothing absorbs.
    pub fn is_empty(&self) -> bool {
        self.inside.is_empty()
    }

    /// Goes through `surface` from the side that it is seen from.
    pub fn cross(&mut self, scene: &Scene, surface: &Surface) {
        let Some(absorption) = scene.materials[surface.material].interior else {
            return;
        };
        if surface.front {
            self.inside.push((surface.object, absorption));
        } else {
            let entered = |&(object, _): &(usize, Rgb)| object == surface.object;
            // A path that began inside has not entered.
            let Some(last) = self.inside.iter().rposition(entered) else {
                return;
            };
            self.inside.remove(last);
        }
        self.absorption = self.inside.iter().map(|&(_, absorption)| absorption).sum();
    }

    /// The share of light that is left after `distance` metres, which may be infinite.
    pub fn transmittance(&self, distance: f32) -> Rgb {
        self.absorption.map(|absorption| {
            // Infinity times 0 is not a number.
            if absorption > 0.0 {
                (-absorption * distance).exp()
            } else {
                1.0
            }
        })
    }
}
