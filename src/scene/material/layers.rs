//! Stacks of interfaces before their parameters are looked up.

use super::super::Surface;
use super::rough::{LEAST_IOR, Reflectance, Roughness, Tangent, ThinFilm, to_model_color};
use super::value::{Number, Point, Tint};
use crate::bsdf::{Closure, Distribution, Frame, Stack, StackLayers};
use crate::color::Rgb;
use crate::features::Features;
use smithwalk_model::layered::{Base, Finish, Interface, Layered, LayeredError};
use smithwalk_model::{self as model, Beckmann, ConductorFresnel, Ggx};

/// A stack, looked up at every point, or made once if it is everywhere the same.
#[derive(Clone, Debug)]
pub struct LayeredMaterial {
    layers: Layers,
    /// Turns of the tangent, counter-clockwise about the normal.
    rotation: Number,
    /// Where the tangent is without rotation.
    tangent: Tangent,
    fixed: Option<&'static Layered<f32>>,
}

/// The layers of a stack.
#[derive(Clone, Debug)]
pub struct Layers {
    /// From the top.
    pub interfaces: Vec<InterfaceLayer>,
    /// What they lie on.
    pub base: BaseLayer,
}

/// An interface and the slab below it.
#[derive(Clone, Copy, Debug)]
pub struct InterfaceLayer {
    /// Absolute index of refraction below.
    pub ior: Number,
    /// How rough it is.
    pub relief: Relief,
    /// What the slab absorbs.
    pub slab: Slab,
    /// What lies on it.
    pub film: Option<ThinFilm>,
}

/// Absorption between two surfaces.
#[derive(Clone, Copy, Debug)]
pub enum Slab {
    /// None.
    Clear,
    /// Per metre, and the thickness in metres.
    Absorbing(Tint, Number),
    /// The share that crosses it at normal incidence.
    Transmitting(Tint),
}

/// How rough a surface of a stack is.
#[derive(Clone, Copy, Debug)]
pub struct Relief {
    /// The distribution of normals, GGX or Beckmann.
    pub distribution: Distribution,
    /// How wide it is.
    pub roughness: Roughness,
}

/// The last layer of a stack.
#[derive(Clone, Debug)]
pub enum BaseLayer {
    /// Nothing.
    Open,
    /// Metal.
    Metal(Relief, Reflectance),
    /// Diffuse facets.
    Matte(Relief, Tint),
    /// Lambert's law.
    Lambert(Tint),
    /// The second has this share.
    Mix(Number, Box<[BaseLayer; 2]>),
}

impl LayeredMaterial {
    /// # Errors
    /// What no stack can be made with, if it is the same everywhere.
    pub fn new(layers: Layers, rotation: Number, tangent: Tangent) -> Result<Self, LayeredError> {
        let fixed = if layers.is_fixed() {
            let stack = layers.at::<{ Features::EVERYTHING.bits() }>(&Point::nowhere())?;
            // One for each material that is compiled: hundreds of bytes.
            Some(&*Box::leak(Box::new(stack)))
        } else {
            None
        };
        Ok(Self {
            layers,
            rotation,
            tangent,
            fixed,
        })
    }

    /// The closure at a point, and the frame that it scatters in.
    #[inline]
    pub(super) fn closure<const F: u32>(
        &self,
        point: &Point<'_>,
        surface: &Surface,
    ) -> Option<(Closure, Frame)> {
        let stack = match self.fixed {
            Some(stack) => StackLayers::Fixed(stack),
            // Textures are clamped to what stacks can be made with.
            None => StackLayers::Made(Box::new(self.layers.at::<F>(point).ok()?)),
        };
        let frame = self.tangent.frame::<F>(self.rotation, point, surface);
        Some((Closure::Layered(Stack::new(stack, point.front)), frame))
    }

    /// Where the tangent points.
    pub(super) fn tangent(&self) -> Tangent {
        self.tangent
    }

    /// Whether light gets through.
    pub(super) fn is_open(&self) -> bool {
        matches!(self.layers.base, BaseLayer::Open)
    }

    /// The colour of the base.
    pub(super) fn albedo<const F: u32>(&self, point: &Point<'_>) -> Rgb {
        self.layers.base.albedo::<F>(point)
    }
}

impl Layers {
    /// Whether no texture has a say.
    fn is_fixed(&self) -> bool {
        self.interfaces.iter().all(|interface| {
            let slab = match interface.slab {
                Slab::Clear => true,
                Slab::Absorbing(absorption, thickness) => {
                    absorption.is_fixed() && thickness.is_fixed()
                }
                Slab::Transmitting(color) => color.is_fixed(),
            };
            let film = interface.film.is_none_or(ThinFilm::is_fixed);
            slab && film && interface.ior.is_fixed() && interface.relief.is_fixed()
        }) && self.base.is_fixed()
    }

    /// The stack at a point.
    fn at<const F: u32>(&self, point: &Point<'_>) -> Result<Layered<f32>, LayeredError> {
        let interfaces = self.interfaces.iter().map(|interface| {
            let (absorption, thickness) = match interface.slab {
                Slab::Clear => (Rgb::ZERO, 1.0),
                Slab::Absorbing(absorption, thickness) => (
                    absorption.at::<F>(point).clamp(Rgb::ZERO, MOST),
                    thickness.at::<F>(point).clamp(0.0, MOST.x),
                ),
                Slab::Transmitting(color) => {
                    let color = color.at::<F>(point).clamp(LEAST_SHARE, Rgb::ONE);
                    (color.map(|share| -share.ln()), 1.0)
                }
            };
            Interface {
                ior: interface.ior.at::<F>(point).max(LEAST_IOR),
                finish: interface.relief.at::<F>(point),
                absorption: to_model_color(absorption),
                thickness,
                film: interface.film.map(|film| film.at::<F>(point)),
                ..Interface::new(1.0, Finish::Smooth)
            }
        });
        let interfaces: smallvec::SmallVec<[_; 4]> = interfaces.collect();
        Layered::new(&interfaces, self.base.at::<F>(point))
    }
}

/// What textures may say at the most; two of them multiply to a finite number.
const MOST: Rgb = Rgb::splat(1e15);

/// And at the least, of a share whose logarithm is taken.
const LEAST_SHARE: Rgb = Rgb::splat(1e-30);

impl Relief {
    fn is_fixed(self) -> bool {
        match self.roughness {
            Roughness::Alpha(x, y) => x.is_fixed() && y.is_fixed(),
            Roughness::Blender {
                roughness,
                anisotropy,
            } => roughness.is_fixed() && anisotropy.is_fixed(),
        }
    }

    fn at<const F: u32>(self, point: &Point<'_>) -> Finish<f32> {
        finish(self.distribution, self.roughness.alphas::<F>(point))
    }
}

/// A finish of these slope roughnesses along the tangent and across.
pub(super) fn finish(distribution: Distribution, [alpha_x, alpha_y]: [f32; 2]) -> Finish<f32> {
    if distribution == Distribution::Beckmann {
        Finish::Beckmann(Beckmann { alpha_x, alpha_y })
    } else {
        Finish::Ggx(Ggx { alpha_x, alpha_y })
    }
}

impl BaseLayer {
    fn is_fixed(&self) -> bool {
        match self {
            Self::Open => true,
            Self::Metal(relief, reflectance) => relief.is_fixed() && reflectance.is_fixed(),
            Self::Matte(relief, tint) => relief.is_fixed() && tint.is_fixed(),
            Self::Lambert(tint) => tint.is_fixed(),
            Self::Mix(share, parts) => share.is_fixed() && parts.iter().all(Self::is_fixed),
        }
    }

    fn at<const F: u32>(&self, point: &Point<'_>) -> Base<f32> {
        let unit = |color: Rgb| to_model_color(color.clamp(Rgb::ZERO, Rgb::ONE));
        match self {
            Self::Open => Base::Open,
            Self::Metal(relief, reflectance) => Base::Conductor {
                finish: relief.at::<F>(point),
                fresnel: clamped(reflectance.at::<F>(point)),
            },
            Self::Matte(relief, tint) => Base::Diffuse {
                finish: relief.at::<F>(point),
                albedo: unit(tint.at::<F>(point)),
            },
            Self::Lambert(tint) => Base::Diffuse {
                finish: Finish::Smooth,
                albedo: unit(tint.at::<F>(point)),
            },
            Self::Mix(share, parts) => {
                let share = share.share::<F>(point);
                let [a, b] = &**parts;
                Base::Mix(vec![
                    (1.0 - share, a.at::<F>(point)),
                    (share, b.at::<F>(point)),
                ])
            }
        }
    }

    fn albedo<const F: u32>(&self, point: &Point<'_>) -> Rgb {
        match self {
            Self::Open => Rgb::ONE,
            Self::Metal(_, reflectance) => Rgb::from(reflectance.at::<F>(point).reflectance(1.0).0),
            Self::Matte(_, tint) | Self::Lambert(tint) => tint.at::<F>(point),
            Self::Mix(share, parts) => {
                let [a, b] = [0, 1].map(|k| parts[k].albedo::<F>(point));
                a.lerp(b, share.share::<F>(point))
            }
        }
    }
}

/// A metal whose textures are in range.
fn clamped(fresnel: ConductorFresnel<f32>) -> ConductorFresnel<f32> {
    let unit = |color: model::Rgb<f32>| color.map(|c| c.clamp(0.0, 1.0));
    match fresnel {
        ConductorFresnel::Constant(color) => ConductorFresnel::Constant(unit(color)),
        ConductorFresnel::Schlick { f0 } => ConductorFresnel::Schlick { f0: unit(f0) },
        ConductorFresnel::F82 { f0, f82 } => ConductorFresnel::F82 {
            f0: unit(f0),
            f82: unit(f82),
        },
        ConductorFresnel::Dielectric { eta, f0, f90 } => ConductorFresnel::Dielectric {
            eta,
            f0: unit(f0),
            f90: unit(f90),
        },
        ConductorFresnel::Complex { eta, k } => ConductorFresnel::Complex {
            eta: eta.map(|c| c.max(LEAST_IOR)),
            k: k.map(|c| c.max(0.0)),
        },
        ConductorFresnel::Film { film, eta, k } => ConductorFresnel::Film {
            film,
            eta: eta.map(|c| c.max(LEAST_IOR)),
            k: k.map(|c| c.max(0.0)),
        },
    }
}
