//! What a path is traced with.

use crate::features::Features;
use crate::film::Aov;
use crate::scene::{RenderSettings, Scene};

/// Surfaces that a ray may pass straight through before it counts as stuck.
pub(super) const MAX_STRAIGHT: u32 = 256;

/// Traces paths through `scene`, with code for the features `F` alone.
pub struct PathTracer<'a, const F: u32> {
    pub(super) scene: &'a Scene,
    pub(super) settings: &'a RenderSettings,
    /// Whether the first hit's AOVs are wanted.
    pub(super) describe_first: bool,
    /// Whether it is to be told how light samples and branches differ.
    pub(super) pilot: bool,
}

impl<'a, const F: u32> PathTracer<'a, F> {
    /// A tracer for a scene whose features are all in `F`.
    ///
    /// # Panics
    /// When they are not.
    #[must_use]
    pub fn new(scene: &'a Scene, settings: &'a RenderSettings, pilot: bool) -> Self {
        assert!(
            Features::from_bits(F).contains(scene.features),
            "the kernel lacks a feature"
        );
        Self {
            scene,
            settings,
            describe_first: settings.aovs.iter().any(Aov::is_of_first_hit),
            pilot,
        }
    }
}
