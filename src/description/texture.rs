//! Textures.

use super::Mesh;
use super::validate::{At, Check};
use super::value::{Clash, ones};
use crate::texture::{Alpha, ColorSpace, Extension, Interpolation};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// What stands for numbers and colours at every point.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(try_from = "RawTexture")]
pub enum Texture {
    /// Images.
    Image(ImageTexture),
    /// The colours of a mesh's vertices, interpolated.
    Colors {
        /// By the name that the mesh gives them.
        colors: String,
        /// How they become linear ones, before they are interpolated.
        color_space: ColorSpace,
    },
}

/// An image and how it is looked up.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageTexture {
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
    /// The name of the texture coordinates, absent for those of the mesh's own file.
    pub uv_map: Option<String>,
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
    file: Option<PathBuf>,
    colors: Option<String>,
    uv_map: Option<String>,
    #[serde(default)]
    color_space: ColorSpace,
    interpolation: Option<Interpolation>,
    extension: Option<Extension>,
    alpha: Option<Alpha>,
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
        let file = match (raw.file, raw.colors) {
            (Some(_), Some(_)) => return Err(Clash::between("file", "colors")),
            (None, None) => {
                return Err(Clash::new("file", "the key `file` or `colors` is missing"));
            }
            (Some(file), None) => file,
            (None, Some(colors)) => {
                let of_images = [
                    ("uv_map", raw.uv_map.is_some()),
                    ("interpolation", raw.interpolation.is_some()),
                    ("extension", raw.extension.is_some()),
                    ("alpha", raw.alpha.is_some()),
                    ("matrix", raw.matrix.is_some()),
                ];
                let given = of_images
                    .iter()
                    .find_map(|(key, given)| given.then_some(*key));
                if let Some(key) = part.or(given) {
                    return Err(Clash::new(key, "this is for images, not for `colors`"));
                }
                return Ok(Self::Colors {
                    colors,
                    color_space: raw.color_space,
                });
            }
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
        Ok(Self::Image(ImageTexture {
            file,
            color_space: raw.color_space,
            interpolation: raw.interpolation.unwrap_or_default(),
            extension: raw.extension.unwrap_or_default(),
            alpha: raw.alpha.unwrap_or_default(),
            placing,
            uv_map: raw.uv_map,
        }))
    }
}

impl Texture {
    /// The image, if it is one.
    #[must_use]
    pub fn image(&self) -> Option<&ImageTexture> {
        match self {
            Self::Image(image) => Some(image),
            Self::Colors { .. } => None,
        }
    }

    /// `meshes` are those of the scene.
    pub(super) fn check(&self, meshes: &BTreeMap<String, Mesh>, check: &mut Check<'_, '_>, at: At) {
        match self {
            Self::Image(image) => {
                image.check(check, &at);
                if let Some(map) = &image.uv_map {
                    let known = meshes.values().flat_map(|mesh| mesh.uv_maps.keys());
                    check.attribute("UV map", map, known, at.key("uv_map"));
                }
            }
            Self::Colors { colors, .. } => {
                let known = meshes.values().flat_map(|mesh| mesh.colors.keys());
                check.attribute("set of colours", colors, known, at.key("colors"));
            }
        }
    }
}

impl ImageTexture {
    fn check(&self, check: &mut Check<'_, '_>, at: &At) {
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
