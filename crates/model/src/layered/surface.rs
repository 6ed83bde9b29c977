//! One surface of a stack.

use crate::fresnel;
use crate::walk::Ray;
use crate::{Beckmann, Bounce, Conductor, Dielectric, Diffuse, Draw, Exit, Facets, Ggx, Glass};
use crate::{Microsurface, Real, Rgb, Side, Vector3};

/// An interface, or a base.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Surface<F: Real> {
    /// A smooth interface.
    Interface(Dielectric<F>),
    /// A smooth interface with colours.
    Colored(Glass<F>),
    /// Smooth metal.
    Mirror(Conductor<F>),
    /// Smooth diffuse facets.
    Lambert(Diffuse<F>),
    /// A rough interface, GGX.
    GgxDielectric(Microsurface<Ggx<F>, Dielectric<F>>),
    /// A rough interface, Beckmann.
    BeckmannDielectric(Microsurface<Beckmann<F>, Dielectric<F>>),
    /// A rough interface with colours, GGX.
    GgxGlass(Microsurface<Ggx<F>, Glass<F>>),
    /// A rough interface with colours, Beckmann.
    BeckmannGlass(Microsurface<Beckmann<F>, Glass<F>>),
    /// Rough metal, GGX.
    GgxConductor(Microsurface<Ggx<F>, Conductor<F>>),
    /// Rough metal, Beckmann.
    BeckmannConductor(Microsurface<Beckmann<F>, Conductor<F>>),
    /// Diffuse facets, GGX.
    GgxDiffuse(Microsurface<Ggx<F>, Diffuse<F>>),
    /// Diffuse facets, Beckmann.
    BeckmannDiffuse(Microsurface<Beckmann<F>, Diffuse<F>>),
}

/// Runs `$body` for whichever rough surface it is, and `$other` for the rest.
macro_rules! each_rough {
    ($surface:expr, $rough:ident => $body:expr, $($other:tt)*) => {
        match $surface {
            Surface::GgxDielectric($rough) => $body,
            Surface::BeckmannDielectric($rough) => $body,
            Surface::GgxGlass($rough) => $body,
            Surface::BeckmannGlass($rough) => $body,
            Surface::GgxConductor($rough) => $body,
            Surface::BeckmannConductor($rough) => $body,
            Surface::GgxDiffuse($rough) => $body,
            Surface::BeckmannDiffuse($rough) => $body,
            $($other)*
        }
    };
}
pub(super) use each_rough;

/// The side of a surface that `w` is on.
#[inline]
pub(super) fn side_of<F: Real>(w: Vector3<F>) -> Side {
    if w.z >= F::zero() {
        Side::Above
    } else {
        Side::Below
    }
}

/// A direction of the stack's frame in the frame of `side`, and back.
#[inline]
pub(super) fn localized<F: Real>(side: Side, w: Vector3<F>) -> Vector3<F> {
    match side {
        Side::Above => w,
        Side::Below => -w,
    }
}

impl<F: Real> Ray<F> {
    /// Light that comes from `w`, above or below, before its first collision.
    #[inline]
    pub(super) fn arriving(w: Vector3<F>) -> Self {
        let side = side_of(w);
        Self {
            side,
            ..Self::entering(localized(side, w))
        }
    }
}

/// What a smooth surface with these facets does with light from `w`; the
/// direction is in the stack's frame.
#[inline]
pub(super) fn bounce_smooth<F: Real, I: Facets<Scalar = F>>(
    facets: &I,
    w: Vector3<F>,
    rng: &mut impl Draw<F>,
) -> Bounce<F> {
    let side = side_of(w);
    let up = Vector3::new(F::zero(), F::zero(), F::one());
    let bounce = facets.scatter(side, localized(side, w), up, rng);
    Bounce {
        direction: localized(side, bounce.direction),
        ..bounce
    }
}

/// The share of light from `w` that a smooth interface without colours lets
/// through, and its direction; both directions in the frame of `side`. `eta` is
/// n(below) / n(above). `None` under total reflection.
pub(super) fn let_through<F: Real>(eta: F, side: Side, w: Vector3<F>) -> Option<(F, Vector3<F>)> {
    let eta = match side {
        Side::Above => eta,
        Side::Below => eta.recip(),
    };
    let (reflectance, cos_t) = fresnel::dielectric(w.z, eta);
    let direction = Vector3::new(-w.x / eta, -w.y / eta, -cos_t).normalized();
    (reflectance < F::one() && cos_t > F::zero()).then_some((F::one() - reflectance, direction))
}

impl<F: Real> Surface<F> {
    /// Whether it sends light into single directions only.
    #[inline]
    pub fn is_delta(&self) -> bool {
        matches!(
            self,
            Self::Interface(_) | Self::Colored(_) | Self::Mirror(_)
        )
    }

    /// Where light from `w` goes, above or below the surface; all orders.
    #[inline]
    pub fn scatter(&self, w: Vector3<F>, rng: &mut impl Draw<F>) -> Option<Exit<F>> {
        match self {
            Self::Interface(facets) => Some(smooth_exit(facets, w, rng)),
            Self::Colored(facets) => Some(smooth_exit(facets, w, rng)),
            Self::Mirror(facets) => Some(smooth_exit(facets, w, rng)),
            Self::Lambert(facets) => Some(smooth_exit(facets, w, rng)),
            Self::GgxDielectric(rough) => from_either_side(rough, w, rng),
            Self::BeckmannDielectric(rough) => from_either_side(rough, w, rng),
            Self::GgxGlass(rough) => from_either_side(rough, w, rng),
            Self::BeckmannGlass(rough) => from_either_side(rough, w, rng),
            Self::GgxConductor(rough) => rough.sample(w, rng),
            Self::BeckmannConductor(rough) => rough.sample(w, rng),
            Self::GgxDiffuse(rough) => rough.sample(w, rng),
            Self::BeckmannDiffuse(rough) => rough.sample(w, rng),
        }
    }

    /// Slope roughness along x and y.
    pub fn alphas(&self) -> [F; 2] {
        match self {
            Self::Interface(_) | Self::Colored(_) | Self::Mirror(_) | Self::Lambert(_) => {
                [F::zero(); 2]
            }
            Self::GgxDielectric(Microsurface { ndf, .. })
            | Self::GgxGlass(Microsurface { ndf, .. })
            | Self::GgxConductor(Microsurface { ndf, .. })
            | Self::GgxDiffuse(Microsurface { ndf, .. }) => [ndf.alpha_x, ndf.alpha_y],
            Self::BeckmannDielectric(Microsurface { ndf, .. })
            | Self::BeckmannGlass(Microsurface { ndf, .. })
            | Self::BeckmannConductor(Microsurface { ndf, .. })
            | Self::BeckmannDiffuse(Microsurface { ndf, .. }) => [ndf.alpha_x, ndf.alpha_y],
        }
    }

    /// The facets' index of refraction below over that above; of interfaces.
    pub fn relative_index(&self) -> Option<F> {
        match self {
            Self::Interface(facets)
            | Self::GgxDielectric(Microsurface { facets, .. })
            | Self::BeckmannDielectric(Microsurface { facets, .. }) => Some(facets.eta),
            Self::Colored(facets)
            | Self::GgxGlass(Microsurface { facets, .. })
            | Self::BeckmannGlass(Microsurface { facets, .. }) => Some(facets.eta),
            _ => None,
        }
    }

    /// The mean reflectance of an interface's film at this cosine of incidence.
    pub fn filmed(&self, side: Side, cos: F) -> Option<F> {
        match self {
            Self::Colored(facets)
            | Self::GgxGlass(Microsurface { facets, .. })
            | Self::BeckmannGlass(Microsurface { facets, .. }) => {
                let film = facets.film.as_ref()?;
                Some(facets.filmed(film, side, cos).1)
            }
            _ => None,
        }
    }

    /// The facets' reflectance at this cosine of incidence, of metals.
    pub fn metal(&self, cos: F) -> Option<Rgb<F>> {
        match self {
            Self::Mirror(facets)
            | Self::GgxConductor(Microsurface { facets, .. })
            | Self::BeckmannConductor(Microsurface { facets, .. }) => {
                Some(facets.fresnel.reflectance(cos))
            }
            _ => None,
        }
    }

    /// The facets' albedo, of diffuse ones.
    pub fn albedo(&self) -> Option<Rgb<F>> {
        match self {
            Self::Lambert(facets)
            | Self::GgxDiffuse(Microsurface { facets, .. })
            | Self::BeckmannDiffuse(Microsurface { facets, .. }) => Some(facets.albedo),
            _ => None,
        }
    }
}

/// One bounce off a smooth surface.
#[inline]
fn smooth_exit<F: Real, I: Facets<Scalar = F>>(
    facets: &I,
    w: Vector3<F>,
    rng: &mut impl Draw<F>,
) -> Exit<F> {
    let bounce = bounce_smooth(facets, w, rng);
    Exit {
        direction: bounce.direction,
        weight: bounce.weight,
        order: 1,
    }
}

/// A walk on a surface that light may come to from below.
#[inline]
fn from_either_side<F, N, I>(
    rough: &Microsurface<N, I>,
    w: Vector3<F>,
    rng: &mut impl Draw<F>,
) -> Option<Exit<F>>
where
    F: Real,
    N: crate::Ndf<Scalar = F>,
    I: Facets<Scalar = F>,
{
    if w.z > F::zero() {
        return rough.sample(w, rng);
    }
    let turned = Microsurface {
        ndf: rough.ndf,
        facets: rough.facets.inverted(),
    };
    let exit = turned.sample(-w, rng)?;
    Some(Exit {
        direction: -exit.direction,
        ..exit
    })
}
