//! What stands for the fine shape of a surface: normal maps.

use super::validate::{At, Check, Range};
use super::value::{Scalar, whole};
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
        check.needs_uvs(&at);
    }
}
