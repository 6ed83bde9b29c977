//! What a camera path is asked for, and what it finds.

use glam::Vec3;

use crate::bsdf::ByOrder;
use crate::color::Rgb;
use crate::film::{Aov, Sample};
use crate::integrator::split::Spread;
use crate::scene::{Scene, Surface};

use super::state::Path;

/// The light that a part of a path found, and what that took.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Found {
    /// Radiance, W·m⁻²·sr⁻¹.
    pub radiance: ByOrder,
    /// The share of the camera's ray that nothing stops, where the world is hidden from it.
    pub let_through: f32,
    /// Rays traced, shadow rays among them.
    pub rays: u32,
}

/// Light carried by one path, and what its first hit looked like.
#[derive(Clone, Copy, Debug, Default)]
pub struct PathResult {
    /// Radiance, W·m⁻²·sr⁻¹.
    pub radiance: ByOrder,
    /// The share of the camera ray that nothing stops, where the world is hidden from it.
    pub let_through: f32,
    /// What the first surface is, if the camera ray met one and AOVs want it.
    pub first: Option<FirstHit>,
    /// Rays traced, shadow rays among them.
    pub rays: u32,
    /// How the light samples at the first surface that scatters differ.
    pub light_samples: Spread,
    /// How the branches behind it differ.
    pub branches: Spread,
}

/// What AOVs say about the first surface.
#[derive(Clone, Copy, Debug)]
pub struct FirstHit {
    /// See [`crate::scene::Material::albedo`].
    pub albedo: Rgb,
    /// Shading normal, world space, on the viewer's side of the surface.
    pub normal: Vec3,
    /// Distance along the camera ray, metres.
    pub distance: f32,
}

impl FirstHit {
    /// At the surface that the camera path has met.
    pub(super) fn of(scene: &Scene, path: &Path, surface: &Surface) -> Self {
        Self {
            albedo: scene.albedo(surface, path.view()),
            normal: scene.normal(surface, path.view()),
            distance: path.last.travelled + path.to_surface,
        }
    }
}

impl PathResult {
    /// Of a path without a surface, or up to its first one.
    pub(super) fn of(found: Found) -> Self {
        Self {
            radiance: found.radiance,
            let_through: found.let_through,
            rays: found.rays,
            ..Self::default()
        }
    }

    /// Adds what a part of the path behind its first surface found.
    pub(super) fn add(&mut self, found: Found) {
        self.radiance += found.radiance;
        self.let_through += found.let_through;
        self.rays += found.rays;
    }

    /// As the film takes it; `gain` is a factor on the light, `depth_scale` turns the
    /// distance along the ray into the depth along the view axis.
    #[must_use]
    pub fn to_sample(self, gain: f32, depth_scale: f32) -> Sample {
        let light = |light: Rgb| (light * gain).to_array();
        let sample = Sample::of(light(self.radiance.total()))
            .with(Aov::Single, light(self.radiance.single))
            .with(Aov::Multiple, light(self.radiance.multiple))
            .with(Aov::Alpha, [1.0 - self.let_through; 3]);
        match self.first {
            Some(first) => sample
                .with(Aov::Albedo, first.albedo.to_array())
                .with(Aov::Normal, first.normal.to_array())
                .with(Aov::Depth, [first.distance * depth_scale; 3]),
            None => sample,
        }
    }
}
