//! Numbers and colours at every point of a surface.

use glam::Vec2;

use super::super::{Object, SceneMesh, Surface, View};
use crate::color::{Rgb, luminance};
use crate::features::{Features, has};
use crate::texture::Channel;
use crate::texture::Texture;

/// What the values of materials are looked up in.
#[derive(Clone, Copy, Debug, Default)]
pub struct Ground<'a> {
    /// The scene's textures.
    pub textures: &'a [Texture],
    /// The object and its mesh; measurements of a material alone have none.
    pub on: Option<(&'a Object, &'a SceneMesh)>,
}

/// A point that materials are looked up at, and who looks at it.
#[derive(Clone, Copy, Debug)]
pub struct Point<'a> {
    /// What it is on.
    pub ground: Ground<'a>,
    /// Texture coordinates.
    pub uv: Vec2,
    /// The cosine between the normal and the viewer, either way round: an interpolated
    /// normal may face away, and nodes take it for the other side then.
    pub cos: f32,
    /// Whether the viewer is outside.
    pub front: bool,
    /// Whether the viewer is the camera.
    pub camera: bool,
}

impl<'a> Point<'a> {
    /// A point to look values up at that are everywhere the same.
    #[must_use]
    pub(super) fn nowhere() -> Self {
        Self {
            ground: Ground::default(),
            uv: Vec2::ZERO,
            cos: 1.0,
            front: true,
            camera: false,
        }
    }

    /// A point as its closures see it: by the shading normal.
    #[must_use]
    #[inline(always)]
    pub fn shaded(ground: Ground<'a>, surface: &Surface, view: View) -> Self {
        Self {
            ground,
            uv: surface.uv,
            cos: surface.normal.dot(view.wo).abs(),
            front: surface.front,
            camera: view.camera,
        }
    }

    /// A point as its emission sees it: by the true normal, which light samples
    /// know, too.
    #[must_use]
    #[inline(always)]
    pub fn shining(ground: Ground<'a>, surface: &Surface, view: View) -> Self {
        Self {
            cos: surface.geometric_normal.dot(view.wo).max(0.0),
            ..Self::shaded(ground, surface, view)
        }
    }
}

/// A number at every point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Number {
    /// Everywhere the same.
    Constant(f32),
    /// A channel of the scene's texture of this index.
    Texture(usize, Channel),
}

impl Number {
    /// The number at a point.
    #[inline]
    pub(super) fn at<const F: u32>(self, point: &Point<'_>) -> f32 {
        match self {
            Self::Constant(value) => value,
            Self::Texture(index, channel) if has::<F>(Features::TEXTURES) => {
                point.ground.textures[index].channel(point.uv.into(), channel)
            }
            Self::Texture(..) => left_out(),
        }
    }

    /// The same between 0 and 1.
    #[inline]
    pub(super) fn share<const F: u32>(self, point: &Point<'_>) -> f32 {
        self.at::<F>(point).clamp(0.0, 1.0)
    }

    /// Its mean over the texture.
    pub(super) fn mean(self, textures: &[Texture]) -> f32 {
        match self {
            Self::Constant(value) => value,
            Self::Texture(index, channel) => {
                let [r, g, b] = textures[index].mean();
                match channel {
                    Channel::R => r,
                    Channel::G => g,
                    Channel::B => b,
                    Channel::A => 1.0,
                    Channel::Luminance => luminance(Rgb::new(r, g, b)),
                }
            }
        }
    }

    /// Whether it is the same at every point.
    pub(super) fn is_fixed(self) -> bool {
        matches!(self, Self::Constant(_))
    }

    /// Whether it is this number at every point.
    #[must_use]
    pub fn is(self, value: f32) -> bool {
        self == Self::Constant(value)
    }
}

/// A colour at every point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tint {
    /// Everywhere the same.
    Constant(Rgb),
    /// Red, green and blue of the scene's texture of this index.
    Texture(usize),
}

impl Tint {
    /// The colour at a point.
    #[inline]
    pub(super) fn at<const F: u32>(self, point: &Point<'_>) -> Rgb {
        match self {
            Self::Constant(value) => value,
            Self::Texture(..) if !has::<F>(Features::TEXTURES) => left_out(),
            Self::Texture(index) => {
                let [r, g, b, _] = point.ground.textures[index].sample(point.uv.into());
                Rgb::new(r, g, b)
            }
        }
    }

    /// Whether it is the same at every point.
    pub(super) fn is_fixed(self) -> bool {
        matches!(self, Self::Constant(_))
    }

    /// Its mean over the texture.
    pub(super) fn mean(self, textures: &[Texture]) -> Rgb {
        match self {
            Self::Constant(color) => color,
            Self::Texture(index) => Rgb::from(textures[index].mean()),
        }
    }
}

/// Where a kernel lacks a feature of its scene, which it is chosen not to.
#[cold]
pub(super) fn left_out() -> ! {
    unreachable!("the kernel has what the scene uses")
}
