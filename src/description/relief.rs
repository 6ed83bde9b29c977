//! What stands for the fine shape of a surface: normal maps and bump.

use super::validate::{At, Check, Range};
use super::value::{Scalar, whole};
use crate::texture::Channel;
use serde::Deserialize;

/// A texture of normals that takes the place of the interpolated one.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NormalMap {
    /// The texture's name; a normal n is stored as the colour (n + 1)/2.
    pub texture: String,
    /// 0 for the interpolated normal, 1 for the map's, and so on in between and beyond.
    #[serde(default = "whole")]
    pub strength: Scalar,
    /// What its axes are.
    #[serde(default)]
    pub space: NormalSpace,
    /// What becomes of normals that a pixel does not resolve.
    #[serde(default)]
    pub filter: NormalFilter,
}

/// What becomes of normals that a pixel does not resolve.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NormalFilter {
    /// They are sampled, one by one.
    #[default]
    None,
    /// Their mean leans the surface, their spread makes it rougher.
    Slopes,
}

/// The axes of a normal map.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NormalSpace {
    /// Along the texture coordinates u and v, and the interpolated normal.
    #[default]
    Tangent,
    /// Those of the object.
    Object,
    /// Those of the world.
    World,
}

impl NormalMap {
    pub(super) fn check(&self, check: &mut Check<'_, '_>, at: At) {
        check.reference("textures", "texture", &self.texture, at.key("texture"));
        check.scalar(&self.strength, Range::NonNegative, at.key("strength"));
        if self.filter == NormalFilter::Slopes && self.space != NormalSpace::Tangent {
            let message = "`filter: slopes` is for normals in tangent space";
            check.report(at.key("filter"), message.to_owned());
        }
        check.needs_uvs(&at);
    }
}

/// A texture of heights, by whose slopes the normal leans.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bump {
    /// The texture's name.
    pub texture: String,
    /// Which of its numbers is the height.
    #[serde(default)]
    pub channel: Channel,
    /// 0 for the normal as it is, 1 for the one that the heights give.
    #[serde(default = "whole")]
    pub strength: Scalar,
    /// How high a height of 1 is, metres.
    #[serde(default = "whole")]
    pub distance: Scalar,
    /// Whether what is high is deep.
    #[serde(default)]
    pub invert: bool,
    /// How far apart the heights are that slopes are taken from, in pixels.
    #[serde(default = "tenth")]
    pub filter_width: f32,
}

fn tenth() -> f32 {
    0.1
}

impl Bump {
    pub(super) fn check(&self, check: &mut Check<'_, '_>, at: At) {
        check.reference("textures", "texture", &self.texture, at.key("texture"));
        check.scalar(&self.strength, Range::NonNegative, at.key("strength"));
        check.scalar(&self.distance, Range::NonNegative, at.key("distance"));
        check.number(
            self.filter_width,
            Range::Above(0.0, 16.0),
            at.key("filter_width"),
        );
        check.needs_uvs(&at);
    }
}

/// What replaces a normal, and what then leans it.
#[derive(Clone, Copy, Debug, Default)]
pub struct Relief<'a> {
    /// The first.
    pub normal: Option<&'a NormalMap>,
    /// The second.
    pub bump: Option<&'a Bump>,
}

impl<'a> Relief<'a> {
    pub(super) fn of(normal: &'a Option<NormalMap>, bump: &'a Option<Bump>) -> Self {
        Self {
            normal: normal.as_ref(),
            bump: bump.as_ref(),
        }
    }

    /// Whether there is nothing of the kind.
    #[must_use]
    pub fn is_flat(&self) -> bool {
        self.normal.is_none() && self.bump.is_none()
    }
}
