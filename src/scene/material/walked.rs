//! Layers as they are: a coat over metal, glass and plastic, side by side.

use std::sync::OnceLock;

use super::super::Surface;
use super::layers::finish;
use super::principled::{LEAST_CHANCE, NONE};
use super::rough::{eta, to_model_color};
use crate::bsdf::{Bsdf, Closure, Distribution, Frame, Stack, StackLayers, WeightedClosure};
use crate::color::Rgb;
use smithwalk_model::layered::{Base, Finish, Interface, Layered};
use smithwalk_model::{ConductorFresnel, Film, Glass};

/// The stacks of a node that is everywhere the same, made when they are first met:
/// without a coat, then with one, in the order of [`Kind`].
pub type FixedStacks = [OnceLock<Layered<f32>>; 6];

/// What lies below a coat.
#[derive(Clone, Copy)]
enum Kind {
    Metal,
    Glass,
    Plastic,
}

/// A surface of three kinds of patches side by side, too fine to be told apart, some
/// of which are coated. Light that has entered a patch leaves by the same.
pub(super) struct Walked {
    /// The share of all patches together.
    pub weight: f32,
    /// The share of the coated ones, and the coat.
    pub coat: (f32, Interface<f32>),
    /// The share of metal: the closure without a coat, and the base below one.
    pub metal: (f32, Closure, Base<f32>),
    /// The share of glass: the closure without a coat, and the interface below one.
    pub glass: (f32, Closure, Interface<f32>),
    /// The share of the rest: its interfaces without a coat and with one, and its
    /// diffuse base.
    pub plastic: (f32, [Interface<f32>; 2], Base<f32>),
    /// Stacks that may be made once.
    pub fixed: Option<&'static FixedStacks>,
}

impl Walked {
    /// Adds the closures. `plain` is the one of a diffuse base without interfaces.
    pub fn add<const F: u32>(
        self,
        bsdf: &mut Bsdf<F>,
        surface: &Surface,
        frame: Frame,
        plain: Closure,
    ) {
        let front = surface.front;
        let mut push = |share: f32, closure: Closure| {
            bsdf.push(WeightedClosure {
                weight: Rgb::splat(share),
                chance: if share > 0.0 {
                    share.max(LEAST_CHANCE)
                } else {
                    0.0
                },
                frame,
                closure,
            });
        };
        let fixed = self.fixed;
        let stack = |kind: Kind, coated: bool, interfaces: &[Interface<f32>], base: &Base<f32>| {
            let make = || {
                Layered::new(interfaces, base.clone())
                    .expect("the values of nodes are clamped to what stacks are made of")
            };
            let stack = match fixed {
                Some(fixed) => {
                    let number = kind as usize + if coated { 3 } else { 0 };
                    StackLayers::Fixed(fixed[number].get_or_init(make))
                }
                None => StackLayers::Made(Box::new(make())),
            };
            Closure::Layered(Stack::new(stack, front))
        };
        let (coated, coat) = self.coat;
        let bare = (1.0 - coated) * self.weight;
        let coated = coated * self.weight;

        let (share, closure, base) = self.metal;
        if share > NONE {
            if coated > NONE {
                push(coated * share, stack(Kind::Metal, true, &[coat], &base));
            }
            push(bare * share, closure);
        }
        let (share, closure, interface) = self.glass;
        if share > NONE {
            if coated > NONE {
                let interfaces = [coat, interface];
                let closure = stack(Kind::Glass, true, &interfaces, &Base::Open);
                push(coated * share, closure);
            }
            push(bare * share, closure);
        }
        let (share, [interface, below_coat], base) = self.plastic;
        if share > NONE {
            if coated > NONE {
                let interfaces = [coat, below_coat];
                push(
                    coated * share,
                    stack(Kind::Plastic, true, &interfaces, &base),
                );
            }
            if bare > NONE {
                let closure = if interface.ior == 1.0 {
                    plain
                } else {
                    stack(Kind::Plastic, false, &[interface], &base)
                };
                push(bare * share, closure);
            }
        }
    }
}

/// A coat that lets `tint` through at normal incidence, there and back.
pub(super) fn coat(ior: f32, alphas: [f32; 2], tint: Rgb) -> Interface<f32> {
    let tint = tint.clamp(LEAST_TINT, Rgb::ONE);
    Interface {
        absorption: to_model_color(tint.map(|c| -0.5 * c.ln())),
        ..Interface::new(ior, finish(Distribution::Ggx, alphas))
    }
}

/// Of a tint whose logarithm is taken.
const LEAST_TINT: Rgb = Rgb::splat(1e-30);

/// An interface of this reflectance at normal incidence over that without colours, or
/// below a film.
pub(super) fn interface(
    ior: f32,
    above: f32,
    alphas: [f32; 2],
    tint: Rgb,
    film: Option<Film<f32>>,
) -> Interface<f32> {
    let f0 = smithwalk_model::fresnel::normal_reflectance(ior / above);
    let most = if f0 > 0.0 { (1.0 / f0).max(1.0) } else { 1.0 };
    // Rounding may bring the product above 1.
    let most = (most * (1.0 - f32::EPSILON)).max(1.0);
    Interface {
        reflection: to_model_color(tint.clamp(Rgb::ZERO, Rgb::splat(most))),
        film,
        ..Interface::new(ior, finish(Distribution::Ggx, alphas))
    }
}

/// The metal below a coat of index `above`, which changes nothing of what it reflects.
pub(super) fn metal(alphas: [f32; 2], fresnel: ConductorFresnel<f32>, above: f32) -> Base<f32> {
    Base::Conductor {
        finish: finish(Distribution::Ggx, alphas),
        fresnel: match fresnel {
            // Relative to the coat, not to air.
            ConductorFresnel::Film { film, eta, k } => ConductorFresnel::Film {
                film,
                eta: eta * above,
                k: k * above,
            },
            colored => colored,
        },
    }
}

/// Diffuse facets with Gaussian slopes of roughness `alpha`; Lambert's law at 0.
pub(super) fn diffuse(albedo: Rgb, alpha: f32) -> Base<f32> {
    Base::Diffuse {
        finish: if alpha > NONE {
            finish(Distribution::Beckmann, [alpha; 2])
        } else {
            Finish::Smooth
        },
        albedo: to_model_color(albedo.clamp(Rgb::ZERO, Rgb::ONE)),
    }
}

/// Glass of this interface by itself, as the viewer sees it.
pub(super) fn glass(interface: Interface<f32>, front: bool) -> Glass<f32> {
    Glass {
        eta: eta(interface.ior, front),
        reflection: interface.reflection,
        transmission: interface.transmission,
        film: film_seen(interface.film, interface.ior, front),
    }
}

/// A film on glass of this index as the viewer sees it, in front of the glass or from
/// inside.
pub(super) fn film_seen(film: Option<Film<f32>>, ior: f32, front: bool) -> Option<Film<f32>> {
    film.map(|film| if front { film } else { film.inverted(ior) })
}
