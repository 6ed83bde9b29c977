//! The image, the sampling and the surroundings.

use super::value;
use crate::film::Aov;
use crate::image::Log2;
use crate::rays::{RayKind, RayKinds};
use serde::Deserialize;
use std::path::PathBuf;

/// Which version of Cycles the watts of lights are read as.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LightUnits {
    /// As in Blender 4.0 and later.
    #[default]
    #[serde(rename = "cycles_4")]
    Cycles4,
    /// As in Blender 3.x.
    #[serde(rename = "cycles_3")]
    Cycles3,
}

/// The image.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Film {
    /// In pixels.
    pub width: u32,
    /// In pixels.
    pub height: u32,
    /// What a pixel averages over.
    pub filter: Filter,
    /// In stops; for PNG alone.
    pub exposure: f32,
    /// A factor on all light, in EXR files too.
    pub gain: f32,
    /// Whether the camera sees nothing, in place of the world, and there is an alpha.
    pub transparent: bool,
    /// How PNGs look; without it plain sRGB.
    pub view: Option<ViewTransform>,
    /// Further images, each once.
    pub aovs: Vec<Aov>,
}

impl Default for Film {
    fn default() -> Self {
        Self {
            width: 256,
            height: 256,
            filter: Filter::Box {},
            exposure: 0.0,
            gain: 1.0,
            transparent: false,
            view: None,
            aovs: Vec::new(),
        }
    }
}

/// From scene-linear light, after the exposure, to what a display shows.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ViewTransform {
    /// A `.cube` file with a three-dimensional table, relative to the scene file.
    pub lut: PathBuf,
    /// Where in the table a value is.
    pub log2: Log2,
}

/// A pixel filter, normalised to 1.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Filter {
    /// The pixel's own square.
    Box {},
    /// The Blackman-Harris window.
    BlackmanHarris {
        /// The full width, in pixels.
        #[serde(default = "blackman_harris_width")]
        width: f32,
    },
}

fn blackman_harris_width() -> f32 {
    1.5
}

/// How many paths, how long, and by which estimator.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Sampling {
    /// Samples per pixel.
    pub spp: u32,
    /// The seed of the random streams.
    pub seed: u64,
    /// Surface interactions after the first hit.
    pub max_bounces: u32,
    /// The first bounce at which Russian roulette may end a path, by its throughput; `None`
    /// has all bounces play by what a path may yet add to its pixel, where that is worth
    /// its time, or else from bounce 8.
    pub roulette_start: Option<u32>,
    /// Into how many branches a path splits at its first surface, on average
    /// over the image: more where it is noisy. 1 is plain path tracing; `None`
    /// leaves it to what a branch costs.
    pub branches: Option<u32>,
    /// How multiple scattering is estimated.
    pub estimator: Estimator,
}

impl Sampling {
    /// The most branches per path: past these, the numbers of one pixel's
    /// branches would soon fill a u32.
    pub const MOST_BRANCHES: u32 = 64;
}

impl Default for Sampling {
    fn default() -> Self {
        Self {
            spp: 64,
            seed: 0,
            max_bounces: 12,
            roulette_start: None,
            branches: None,
            estimator: Estimator::Auto,
        }
    }
}

/// How scattering at rough surfaces is estimated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Estimator {
    /// The best for the scene.
    #[default]
    Auto,
    /// The unidirectional random walk.
    Walk,
    /// Walks from both sides, connected.
    TwoWalk,
    /// The position-free estimator.
    PositionFree,
    /// Single scattering alone, which loses energy.
    Single,
    /// Single scattering scaled to the right albedo.
    Compensated,
}

/// What surrounds the scene.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum World {
    /// The same radiance from everywhere.
    Constant {
        /// Scene-linear Rec. 709.
        #[serde(default = "value::ones", deserialize_with = "value::triple")]
        color: [f32; 3],
        /// The factor that makes `color` a radiance in W·m⁻²·sr⁻¹.
        #[serde(default = "value::one")]
        strength: f32,
        /// Rays that see black instead.
        #[serde(default)]
        hidden_from: Vec<RayKind>,
    },
    /// An equirectangular image.
    Environment {
        /// An EXR or HDR file, relative to the scene file.
        file: PathBuf,
        /// The factor that makes the image a radiance in W·m⁻²·sr⁻¹.
        #[serde(default = "value::one")]
        strength: f32,
        /// A further factor per channel.
        #[serde(default = "value::ones", deserialize_with = "value::triple")]
        color: [f32; 3],
        /// Euler angles in degrees, about x first, then y, then z, applied to
        /// directions before the image is looked up.
        #[serde(default)]
        rotation: [f32; 3],
        /// Rays that see black instead.
        #[serde(default)]
        hidden_from: Vec<RayKind>,
    },
}

impl World {
    /// The rays that see it.
    #[must_use]
    pub fn seen_by(&self) -> RayKinds {
        let (Self::Constant { hidden_from, .. } | Self::Environment { hidden_from, .. }) = self;
        RayKinds::all_but(hidden_from.iter().copied())
    }
}
