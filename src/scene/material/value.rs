//! Numbers and colours at every point of a surface.

use glam::Vec2;

use super::super::{Object, SceneMesh, Surface, View};
use crate::color::{Rgb, luminance};
use crate::features::{Features, has};
use crate::texture::{Channel, ColorSpace, Texture};

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
    /// The first texture coordinates.
    pub uv: Vec2,
    /// The triangle within the mesh.
    pub triangle: u32,
    /// Barycentric weights of its second and third corner.
    pub weights: Vec2,
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
            triangle: 0,
            weights: Vec2::ZERO,
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
            triangle: surface.triangle,
            weights: surface.weights,
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

impl Point<'_> {
    /// What a texture says here.
    #[inline]
    fn sample<const F: u32>(&self, index: usize) -> [f32; 4] {
        let texture = &self.ground.textures[index];
        texture.sample(self.uv_of::<F>(texture.uv_map()).into())
    }

    /// The texture coordinates of this number.
    #[inline]
    pub(super) fn uv_of<const F: u32>(&self, map: usize) -> Vec2 {
        if !has::<F>(Features::ATTRIBUTES) || map == 0 {
            return self.uv;
        }
        let uvs = self.ground.on.and_then(|(_, mesh)| mesh.uvs(map));
        uvs.map_or(Vec2::ZERO, |uvs| {
            let [a, b, c] = self.corners(uvs).map(Vec2::from);
            let [u, v] = self.weights.into();
            a * (1.0 - u - v) + b * u + c * v
        })
    }

    /// Colours of vertices here; black where the mesh has none of the name.
    fn color(&self, VertexColors { set, color_space }: VertexColors) -> Rgb {
        let colors = self
            .ground
            .on
            .and_then(|(_, mesh)| mesh.colors.get(set)?.as_deref());
        colors.map_or(Rgb::ZERO, |colors| {
            let decode = |color: [f32; 3]| Rgb::from(color.map(|c| color_space.decode(c)));
            let [a, b, c] = self.corners(colors).map(decode);
            let [u, v] = self.weights.into();
            a * (1.0 - u - v) + b * u + c * v
        })
    }

    /// What the triangle's corners have.
    fn corners<T: Copy + Default>(&self, values: &[T]) -> [T; 3] {
        match self.ground.on {
            Some((_, mesh)) => {
                mesh.triangles[self.triangle as usize].map(|index| values[index as usize])
            }
            None => [T::default(); 3],
        }
    }
}

/// Colours of vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VertexColors {
    /// The number of their name among all of the scene.
    pub set: usize,
    /// How they become linear, before they are interpolated.
    pub color_space: ColorSpace,
}

/// A number at every point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Number {
    /// Everywhere the same.
    Constant(f32),
    /// A channel of the scene's texture of this index.
    Texture(usize, Channel),
    /// A channel of colours of vertices.
    Colors(VertexColors, Channel),
}

impl Number {
    /// The number at a point.
    #[inline]
    pub(super) fn at<const F: u32>(self, point: &Point<'_>) -> f32 {
        match self {
            Self::Constant(value) => value,
            Self::Texture(index, channel) if has::<F>(Features::TEXTURES) => {
                channel.of(point.sample::<F>(index))
            }
            Self::Colors(colors, channel) if has::<F>(Features::ATTRIBUTES) => {
                let [r, g, b] = point.color(colors).into();
                channel.of([r, g, b, 1.0])
            }
            Self::Texture(..) | Self::Colors(..) => left_out(),
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
            Self::Colors(..) => UNKNOWN_MEAN,
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
    /// Colours of vertices.
    Colors(VertexColors),
}

impl Tint {
    /// The colour at a point.
    #[inline]
    pub(super) fn at<const F: u32>(self, point: &Point<'_>) -> Rgb {
        match self {
            Self::Constant(value) => value,
            Self::Texture(index) if has::<F>(Features::TEXTURES) => {
                let [r, g, b, _] = point.sample::<F>(index);
                Rgb::new(r, g, b)
            }
            Self::Colors(colors) if has::<F>(Features::ATTRIBUTES) => point.color(colors),
            Self::Texture(..) | Self::Colors(..) => left_out(),
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
            Self::Colors(_) => Rgb::splat(UNKNOWN_MEAN),
            Self::Texture(index) => Rgb::from(textures[index].mean()),
        }
    }
}

/// What stands for the mean of colours of vertices, which differs from mesh to mesh:
/// how much light is expected decides about its samples alone.
const UNKNOWN_MEAN: f32 = 0.5;

/// Where a kernel lacks a feature of its scene, which it is chosen not to.
#[cold]
pub(super) fn left_out() -> ! {
    unreachable!("the kernel has what the scene uses")
}
