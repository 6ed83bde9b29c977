//! Rough materials: what their parameters are at a point, and the closure that
//! comes of them.

use super::super::Surface;
use super::value::{Number, Point, Tint};
use crate::bsdf::{
    Closure, Distribution, FacetKind, Frame, Interface, Lambert, Method, Mirror, RoughClosure,
};
use crate::color::Rgb;
use crate::description::Axis;
use crate::features::{Features, has};
use smithwalk_model::{
    self as model, Conductor, ConductorFresnel, Dielectric, Diffuse, Film, Refraction,
};

/// How rough, in the two languages of the files.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Roughness {
    /// Slope roughness along the tangent and across it.
    Alpha(Number, Number),
    /// Blender's: α = roughness², stretched by the Anisotropic node's rule.
    Blender {
        /// √α, 0 to 1.
        roughness: Number,
        /// −1 to 1.
        anisotropy: Number,
    },
}

impl Roughness {
    #[inline]
    pub(super) fn alphas<const F: u32>(self, point: &Point<'_>) -> [f32; 2] {
        match self {
            Self::Alpha(x, y) => {
                let at = |number: Number| number.at::<F>(point).max(0.0);
                [at(x), at(y)]
            }
            Self::Blender {
                roughness,
                anisotropy,
            } => blender_alphas(roughness.share::<F>(point), anisotropy.at::<F>(point)),
        }
    }

    /// Whether it is 0 at every point.
    #[must_use]
    pub fn is_smooth(self) -> bool {
        match self {
            Self::Alpha(x, y) => x.is(0.0) && y.is(0.0),
            Self::Blender { roughness, .. } => roughness.is(0.0),
        }
    }
}

/// α_x and α_y of Blender's Anisotropic node: a > 0 narrows the lobe along the
/// tangent. The clamp of |a| keeps 1 − |a| from vanishing, as Cycles does.
#[must_use]
pub fn blender_alphas(roughness: f32, anisotropy: f32) -> [f32; 2] {
    let alpha = roughness * roughness;
    let a = anisotropy.clamp(-0.99, 0.99);
    let (x, y) = if a < 0.0 {
        (alpha / (1.0 + a), alpha * (1.0 + a))
    } else {
        (alpha * (1.0 - a), alpha / (1.0 - a))
    };
    [x.min(1.0), y.min(1.0)]
}

/// The Fresnel law of a metal.
#[derive(Clone, Copy, Debug)]
pub enum Reflectance {
    /// The same at all angles.
    Constant(Tint),
    /// Complex indices, η + ik.
    Complex {
        /// η.
        eta: Tint,
        /// k.
        k: Tint,
    },
    /// Schlick's, from normal incidence.
    Schlick(Tint),
    /// Schlick's through a point at cosθ = 1/7.
    F82 {
        /// At normal incidence.
        f0: Tint,
        /// At cosθ = 1/7.
        f82: Tint,
    },
    /// The same, as a factor on Schlick's value there.
    EdgeTint {
        /// At normal incidence.
        f0: Tint,
        /// The factor.
        tint: Tint,
    },
    /// A thin film on a metal of complex indices.
    Film {
        /// The film.
        film: ThinFilm,
        /// η.
        eta: Tint,
        /// k.
        k: Tint,
    },
}

impl Reflectance {
    /// Whether it is the same at every point.
    pub(super) fn is_fixed(self) -> bool {
        match self {
            Self::Constant(tint) | Self::Schlick(tint) => tint.is_fixed(),
            Self::Complex { eta: a, k: b }
            | Self::F82 { f0: a, f82: b }
            | Self::EdgeTint { f0: a, tint: b } => a.is_fixed() && b.is_fixed(),
            Self::Film { film, eta, k } => film.is_fixed() && eta.is_fixed() && k.is_fixed(),
        }
    }

    #[inline]
    pub(super) fn at<const F: u32>(self, point: &Point<'_>) -> ConductorFresnel<f32> {
        let at = |tint: Tint| to_model_color(tint.at::<F>(point));
        match self {
            Self::Constant(tint) => ConductorFresnel::Constant(at(tint)),
            Self::Complex { eta, k } => ConductorFresnel::Complex {
                eta: at(eta),
                k: at(k),
            },
            Self::Schlick(f0) => ConductorFresnel::Schlick { f0: at(f0) },
            Self::F82 { f0, f82 } => ConductorFresnel::F82 {
                f0: at(f0),
                f82: at(f82),
            },
            Self::EdgeTint { f0, tint } => edge_tinted(f0.at::<F>(point), tint.at::<F>(point)),
            Self::Film { film, eta, k } => ConductorFresnel::Film {
                film: film.at::<F>(point),
                eta: at(eta),
                k: at(k),
            },
        }
    }
}

/// A thin film.
#[derive(Clone, Copy, Debug)]
pub struct ThinFilm {
    /// Index of refraction, absolute.
    pub ior: Number,
    /// Thickness, nm.
    pub thickness: Number,
}

impl ThinFilm {
    pub(super) fn is_fixed(self) -> bool {
        self.ior.is_fixed() && self.thickness.is_fixed()
    }

    pub(super) fn at<const F: u32>(self, point: &Point<'_>) -> Film<f32> {
        film(self.ior.at::<F>(point), self.thickness.at::<F>(point), 1.0)
    }
}

/// A film of this index and this thickness in nm, as textures may say it, on this share
/// of the facets.
pub(super) fn film(ior: f32, thickness: f32, cover: f32) -> Film<f32> {
    Film {
        ior: ior.max(LEAST_IOR),
        thickness: thickness.clamp(0.0, MOST_NANOMETRES),
        cover,
    }
}

/// A metal that reflects as `fresnel`, an edge-tinted one, below a film: of the complex
/// indices that agree with it at normal incidence and at cosθ = 1/7.
pub(super) fn filmed(
    fresnel: ConductorFresnel<f32>,
    film: Option<Film<f32>>,
) -> ConductorFresnel<f32> {
    match (fresnel, film) {
        (ConductorFresnel::F82 { f0, f82 }, Some(film)) => {
            let through = |c: usize| model::fresnel::complex_through(f0.0[c], f82.0[c]);
            let indices: [(f32, f32); 3] = std::array::from_fn(through);
            ConductorFresnel::Film {
                film,
                eta: model::Rgb(indices.map(|(eta, _)| eta)),
                k: model::Rgb(indices.map(|(_, k)| k)),
            }
        }
        (plain, _) => plain,
    }
}

/// Thicker films have no colours left.
const MOST_NANOMETRES: f32 = 1e6;

/// Schlick's curve from `f0`, multiplied by `tint` at cosθ = 1/7: "F82-tint" of
/// Kutz et al. 2021, "Novel aspects of the Adobe Standard Material".
pub(super) fn edge_tinted(f0: Rgb, tint: Rgb) -> ConductorFresnel<f32> {
    let schlick = f0.map(|f0| model::fresnel::schlick(1.0 / 7.0, f0));
    ConductorFresnel::F82 {
        f0: to_model_color(f0),
        f82: to_model_color(schlick * tint),
    }
}

/// What the facets are made of.
#[derive(Clone, Copy, Debug)]
pub enum Facet {
    /// Metal.
    Metal(Reflectance),
    /// Glass: index of refraction inside over outside, and a colour.
    Glass(Number, Tint),
    /// What glass lets through.
    Refraction(Number, Tint),
    /// Lambertian.
    Matte(Tint),
}

impl Facet {
    /// Their kind.
    #[must_use]
    pub fn kind(self) -> FacetKind {
        match self {
            Self::Metal(_) => FacetKind::Conductor,
            Self::Glass(..) => FacetKind::Dielectric,
            Self::Refraction(..) => FacetKind::Refraction,
            Self::Matte(_) => FacetKind::Diffuse,
        }
    }
}

/// Where the x axis of a closure's frame points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tangent {
    /// Nowhere in particular: the closure is isotropic.
    Any,
    /// Along the texture coordinate u.
    Uv,
    /// Round an axis of the object.
    Radial(Axis),
}

impl Tangent {
    /// The frame to scatter in; only anisotropic closures need the tangent.
    #[inline]
    pub(super) fn frame<const F: u32>(
        self,
        rotation: Number,
        point: &Point<'_>,
        surface: &Surface,
    ) -> Frame {
        if !has::<F>(Features::ANISOTROPY) {
            return Frame::about(surface.normal);
        }
        let tangent = match self {
            Self::Any => return Frame::about(surface.normal),
            Self::Uv => surface.tangent_along_u(),
            Self::Radial(axis) => {
                let local = surface.radial_tangent(axis);
                let object = point.ground.on.map(|(object, _)| object);
                object.map_or(local, |object| object.normal_to_world * local)
            }
        };
        Frame::with_tangent(surface.normal, tangent, rotation.at::<F>(point))
    }
}

/// A rough material before its parameters are looked up.
#[derive(Clone, Copy, Debug)]
pub struct RoughMaterial {
    /// The distribution of normals.
    pub distribution: Distribution,
    /// How wide it is.
    pub roughness: Roughness,
    /// Turns of the tangent, counter-clockwise about the normal.
    pub rotation: Number,
    /// Where the tangent is without rotation.
    pub tangent: Tangent,
    /// What the facets are.
    pub facet: Facet,
    /// Which orders, and how they are estimated.
    pub method: Method,
}

impl RoughMaterial {
    #[inline]
    pub(super) fn closure<const F: u32>(&self, point: &Point<'_>) -> Closure {
        self.closure_of::<F>(point, self.roughness.alphas::<F>(point))
    }

    /// The same of other roughnesses.
    #[inline]
    pub(super) fn closure_of<const F: u32>(&self, point: &Point<'_>, alphas: [f32; 2]) -> Closure {
        let smooth = alphas == [0.0; 2];
        // A groove: smooth one way only. The model has no such limit; this is
        // far below what f32 directions resolve.
        let alphas = alphas.map(|alpha| alpha.max(MIN_ALPHA));
        let color = |tint: Tint| tint.at::<F>(point);
        let eta = |ior: Number| eta(ior.at::<F>(point), point.front);
        let (distribution, method) = (self.distribution, self.method);
        match self.facet {
            Facet::Metal(reflectance) => {
                let fresnel = reflectance.at::<F>(point);
                if smooth {
                    return Closure::Mirror(Mirror { fresnel });
                }
                let facets = Conductor { fresnel };
                Closure::Rough(RoughClosure::new(distribution, alphas, facets, method))
            }
            Facet::Glass(ior, tint) => {
                let (eta, color) = (eta(ior), color(tint));
                if smooth {
                    return Closure::Interface(Interface::colored(eta, color));
                }
                let tint = to_model_color(color);
                let facets = Dielectric { eta, tint };
                Closure::Rough(RoughClosure::new(distribution, alphas, facets, method))
            }
            Facet::Refraction(ior, tint) => {
                let (eta, color) = (eta(ior), color(tint));
                if smooth {
                    return Closure::Interface(Interface::refracting(eta, color));
                }
                let tint = to_model_color(color);
                let facets = Refraction { eta, tint };
                Closure::Rough(RoughClosure::new(distribution, alphas, facets, method))
            }
            Facet::Matte(tint) => {
                let albedo = color(tint);
                if smooth {
                    return Closure::Lambert(Lambert { albedo });
                }
                let albedo = to_model_color(albedo);
                let facets = Diffuse { albedo };
                Closure::Rough(RoughClosure::new(distribution, alphas, facets, method))
            }
        }
    }

    /// The colour of the facets.
    pub(super) fn albedo<const F: u32>(&self, point: &Point<'_>) -> Rgb {
        match self.facet {
            Facet::Metal(reflectance) => Rgb::from(reflectance.at::<F>(point).reflectance(1.0).0),
            Facet::Glass(_, tint) | Facet::Refraction(_, tint) | Facet::Matte(tint) => {
                tint.at::<F>(point)
            }
        }
    }
}

/// n(far)/n(near) for the viewer's side.
#[inline]
pub(super) fn eta(ior: f32, front: bool) -> f32 {
    let ior = ior.max(LEAST_IOR);
    if front { ior } else { 1.0 / ior }
}

/// The least roughness across a groove that is smooth along it.
pub(super) const MIN_ALPHA: f32 = 1e-7;

/// The least index of refraction, for textures; as in Cycles.
pub(super) const LEAST_IOR: f32 = 1e-5;

pub(super) fn to_model_color(color: Rgb) -> model::Rgb<f32> {
    model::Rgb(color.to_array())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The Anisotropic node's rule, worked by hand.
    #[test]
    fn anisotropy_follows_the_blender_node() {
        let close =
            |[x, y]: [f32; 2], [a, b]: [f32; 2]| (x - a).abs() < 1e-6 && (y - b).abs() < 1e-6;
        assert!(close(blender_alphas(0.5, 0.0), [0.25, 0.25]));
        assert!(close(blender_alphas(0.5, 0.5), [0.125, 0.5]));
        assert!(close(blender_alphas(0.5, -0.5), [0.5, 0.125]));
        assert!(
            close(blender_alphas(0.9, 0.5), [0.405, 1.0]),
            "the larger one is clamped"
        );
    }
}
