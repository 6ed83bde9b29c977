//! Textures.

use super::validate::{At, Check};
use super::value::{Clash, ones};
use crate::texture::{Alpha, ColorSpace, Extension, Interpolation};
use serde::Deserialize;
use std::path::PathBuf;

/// An image and how it is looked up.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(try_from = "RawTexture")]
pub struct Texture {
    /// The image file, relative to the scene file; `<UDIM>` in its name stands for the
    /// number of a tile.
    pub file: PathBuf,
    /// How stored values become linear ones.
    pub color_space: ColorSpace,
    /// What happens between pixel centres.
    pub interpolation: Interpolation,
    /// What is beyond the edges.
    pub extension: Extension,
    /// What alpha does to the colour.
    pub alpha: Alpha,
    /// From texture coordinates to the image.
    pub placing: Placing,
}

/// From texture coordinates to an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Placing {
    /// Steps, in this order.
    Parts {
        /// The factors that multiply u and v.
        scale: [f32; 2],
        /// How far they are then turned, counter-clockwise, degrees.
        rotation: f32,
        /// What is then added.
        offset: [f32; 2],
    },
    /// Rows of the factors of u and v, and of what is added.
    Matrix([[f32; 3]; 2]),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawTexture {
    file: PathBuf,
    #[serde(default)]
    color_space: ColorSpace,
    #[serde(default)]
    interpolation: Interpolation,
    #[serde(default)]
    extension: Extension,
    #[serde(default)]
    alpha: Alpha,
    scale: Option<[f32; 2]>,
    rotation: Option<f32>,
    offset: Option<[f32; 2]>,
    matrix: Option<[[f32; 3]; 2]>,
}

impl TryFrom<RawTexture> for Texture {
    type Error = Clash;

    fn try_from(raw: RawTexture) -> Result<Self, Clash> {
        let part = match raw {
            RawTexture { scale: Some(_), .. } => Some("scale"),
            RawTexture {
                rotation: Some(_), ..
            } => Some("rotation"),
            RawTexture {
                offset: Some(_), ..
            } => Some("offset"),
            _ => None,
        };
        let placing = match (raw.matrix, part) {
            (Some(_), Some(part)) => return Err(Clash::between("matrix", part)),
            (Some(matrix), None) => Placing::Matrix(matrix),
            (None, _) => Placing::Parts {
                scale: raw.scale.unwrap_or_else(ones),
                rotation: raw.rotation.unwrap_or_default(),
                offset: raw.offset.unwrap_or_default(),
            },
        };
        Ok(Self {
            file: raw.file,
            color_space: raw.color_space,
            interpolation: raw.interpolation,
            extension: raw.extension,
            alpha: raw.alpha,
            placing,
        })
    }
}

impl Texture {
    pub(super) fn check(&self, check: &mut Check<'_, '_>, at: At) {
        match self.placing {
            Placing::Parts { scale, .. } if scale.contains(&0.0) => {
                check.report(at.key("scale"), "expected factors other than 0".to_owned());
            }
            Placing::Matrix([[a, b, _], [c, d, _]]) if a * d == b * c => {
                let message = "this matrix has no inverse: it flattens the texture";
                check.report(at.key("matrix"), message.to_owned());
            }
            _ => {}
        }
    }
}
