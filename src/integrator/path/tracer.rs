//! What a path is traced with.

use crate::embree::{Hit, Ray};
use crate::features::{Features, has};
use crate::film::Aov;
use crate::rays::RayKind;
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

impl<const F: u32> PathTracer<'_, F> {
    /// The nearest hit of what a ray of this kind meets.
    #[inline(always)]
    pub(super) fn intersect(&self, ray: Ray, kind: RayKind) -> Option<Hit> {
        let accelerator = &self.scene.accelerator;
        if has::<F>(Features::RAY_VISIBILITY) {
            accelerator.intersect_as(kind, ray)
        } else {
            accelerator.intersect(ray)
        }
    }

    /// Whether anything that shadow rays meet is on the ray's segment.
    #[inline(always)]
    pub(super) fn occluded(&self, ray: Ray) -> bool {
        let accelerator = &self.scene.accelerator;
        if has::<F>(Features::RAY_VISIBILITY) {
            accelerator.occluded_as(RayKind::Shadow, ray)
        } else {
            accelerator.occluded(ray)
        }
    }
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
