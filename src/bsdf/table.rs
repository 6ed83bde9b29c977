//! The one list of distributions of facet normals, and the one of kinds of
//! facets: every rough closure is a pair of the two.

use glam::Vec3;
use serde::Deserialize;

use super::{BsdfSample, Method, Rough};
use crate::features::{Features, has};
use smithwalk_model::{
    Beckmann, Conductor, Dielectric, Diffuse, Draw, Facets, Ggx, Glass, Microsurface, Ndf,
    NdfInLanes, Quadratic, Refraction, Tally,
};

/// What the renderer asks of a distribution beside [`Ndf`].
pub trait Width: Ndf<Scalar = f32> {
    /// With these slope roughnesses along x and y, if it has any.
    fn of(alpha_x: f32, alpha_y: f32) -> Self;

    /// The slope roughnesses along x and y.
    fn alphas(&self) -> [f32; 2];

    /// The α of the isotropic surface that is about as rough.
    #[inline]
    fn width(&self) -> f32 {
        let [x, y] = self.alphas();
        (x * y).sqrt()
    }
}

/// What the renderer asks of a distribution; of one without a roughness if it
/// is called `constant`.
macro_rules! width {
    ($ndf:ident) => {
        impl Width for $ndf<f32> {
            #[inline]
            fn of(alpha_x: f32, alpha_y: f32) -> Self {
                Self { alpha_x, alpha_y }
            }

            #[inline]
            fn alphas(&self) -> [f32; 2] {
                [self.alpha_x, self.alpha_y]
            }
        }
    };
    ($ndf:ident constant) => {
        impl Width for $ndf<f32> {
            #[inline]
            fn of(_: f32, _: f32) -> Self {
                Self::new()
            }

            /// About what its slopes have.
            #[inline]
            fn alphas(&self) -> [f32; 2] {
                [1.0; 2]
            }
        }
    };
}

/// Declares distributions with the feature that each needs beside those of its
/// facets.
macro_rules! distributions {
    ($($(#[$doc:meta])* $ndf:ident $($constant:ident)?: $feature:expr;)*) => {
        /// The distribution of facet normals.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
        #[serde(rename_all = "snake_case")]
        pub enum Distribution {
            $($(#[$doc])* $ndf,)*
        }

        impl Distribution {
            /// All of them.
            pub const ALL: &[Self] = &[$(Self::$ndf),*];

            /// What a kernel needs for it.
            #[must_use]
            pub const fn feature(self) -> Features {
                match self {
                    $(Self::$ndf => $feature,)*
                }
            }
        }

        /// A rough closure, by its distribution.
        #[derive(Clone, Copy, Debug)]
        pub enum RoughClosure {
            $($(#[$doc])* $ndf(ByFacets<$ndf<f32>>),)*
        }

        impl RoughClosure {
            /// A microsurface with slope roughness `alpha` along x and y.
            #[inline]
            pub fn new(
                distribution: Distribution,
                [alpha_x, alpha_y]: [f32; 2],
                facets: impl Listed,
                method: Method,
            ) -> Self {
                match distribution {
                    $(Distribution::$ndf => {
                        let ndf = <$ndf<f32>>::of(alpha_x, alpha_y);
                        let surface = Microsurface { ndf, facets };
                        Self::$ndf(Listed::pair(Rough { surface, method }))
                    })*
                }
            }

            /// Whether its facets are diffuse: its light is, too.
            #[inline(always)]
            pub(super) fn has_diffuse_facets(&self) -> bool {
                match self {
                    $(Self::$ndf(by) => matches!(by, ByFacets::Diffuse(_)),)*
                }
            }

            #[inline(always)]
            pub(super) fn is_in<const F: u32>(&self) -> bool {
                match self {
                    $(Self::$ndf(by) => has::<F>($feature) && by.is_in::<F>(),)*
                }
            }

            #[inline(always)]
            pub(super) fn sample(&self, wo: Vec3, rng: &mut impl Draw<f32>) -> Option<BsdfSample> {
                match self {
                    $(Self::$ndf(by) => by.sample(wo, rng),)*
                }
            }

            #[inline(always)]
            pub(super) fn eval(
                &self,
                wo: Vec3,
                wi: Vec3,
                rng: &mut impl Draw<f32>,
                tally: &mut impl Tally<f32>,
            ) {
                match self {
                    $(Self::$ndf(by) => by.eval(wo, wi, rng, tally),)*
                }
            }

            #[inline(always)]
            pub(super) fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
                match self {
                    $(Self::$ndf(by) => by.pdf(wo, wi),)*
                }
            }
        }

        $(width!($ndf $($constant)?);)*

        /// Runs `$body` with `$name` standing for the distribution's type.
        macro_rules! with_ndf {
            ($distribution:expr, $name:ident => $body:expr) => {
                match $distribution {
                    $(Distribution::$ndf => {
                        type $name = ::smithwalk_model::$ndf<f32>;
                        $body
                    })*
                }
            };
        }
    };
}

/// Declares kinds of facets with the feature that each needs.
macro_rules! facets {
    ($($(#[$doc:meta])* $kind:ident: $feature:expr;)*) => {
        /// A kind of facets.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum FacetKind {
            $($(#[$doc])* $kind,)*
        }

        impl FacetKind {
            /// All of them.
            pub const ALL: &[Self] = &[$(Self::$kind),*];

            /// What a kernel needs for them.
            #[must_use]
            pub const fn feature(self) -> Features {
                match self {
                    $(Self::$kind => $feature,)*
                }
            }
        }

        /// A rough closure with normals distributed by `N`, by its facets.
        #[derive(Clone, Copy, Debug)]
        pub enum ByFacets<N> {
            $($(#[$doc])* $kind(Rough<N, $kind<f32>>),)*
        }

        $(impl Listed for $kind<f32> {
            const KIND: FacetKind = FacetKind::$kind;

            #[inline(always)]
            fn pair<N>(rough: Rough<N, Self>) -> ByFacets<N> {
                ByFacets::$kind(rough)
            }
        })*

        impl<N: Width> ByFacets<N> {
            #[inline(always)]
            fn is_in<const F: u32>(&self) -> bool {
                match self {
                    $(Self::$kind(rough) => has::<F>($feature) && rough.is_in::<F>(),)*
                }
            }

            #[inline(always)]
            fn sample(&self, wo: Vec3, rng: &mut impl Draw<f32>) -> Option<BsdfSample> {
                match self {
                    $(Self::$kind(rough) => rough.sample(wo, rng),)*
                }
            }

            #[inline(always)]
            fn eval(
                &self,
                wo: Vec3,
                wi: Vec3,
                rng: &mut impl Draw<f32>,
                tally: &mut impl Tally<f32>,
            ) {
                match self {
                    $(Self::$kind(rough) => rough.eval(wo, wi, rng, tally),)*
                }
            }

            #[inline(always)]
            fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
                match self {
                    $(Self::$kind(rough) => rough.pdf(wo, wi),)*
                }
            }
        }
    };
}

/// Facets that are on the list.
pub trait Listed: Facets<Scalar = f32> {
    /// Their kind.
    const KIND: FacetKind;

    /// A rough closure of such facets.
    fn pair<N>(rough: Rough<N, Self>) -> ByFacets<N>;
}

distributions! {
    /// Trowbridge–Reitz.
    Ggx: Features::NONE;
    /// Gaussian slopes.
    Beckmann: Features::BECKMANN;
    /// D(m) ∝ m_z², without a roughness.
    Quadratic constant: Features::QUADRATIC;
}

facets! {
    /// Mirrors that absorb by Fresnel's law for metals.
    Conductor: Features::METALS;
    /// Smooth interfaces of transparent media.
    Dielectric: Features::TRANSMISSION;
    /// Lambertian.
    Diffuse: Features::DIFFUSE_FACETS;
    /// Interfaces that reflect nothing.
    Refraction: Features::SPLIT_GLASS;
    /// Interfaces whose reflection and transmission are coloured apart.
    Glass: Features::SPLIT_GLASS;
}

impl Distribution {
    /// Whether it comes in widths.
    #[must_use]
    pub const fn has_roughness(self) -> bool {
        !matches!(self, Self::Quadratic)
    }
}

#[expect(
    clippy::derivable_impls,
    reason = "an attribute of one row would be in every list made of it"
)]
impl Default for Distribution {
    fn default() -> Self {
        Self::Ggx
    }
}

/// Distributions that metals are evaluated with in lanes.
pub trait WidthInLanes: Width + NdfInLanes {
    /// The width from which that is worth its time.
    const LANES_FROM: f32;
}

impl WidthInLanes for Ggx<f32> {
    /// There, all orders always are.
    const LANES_FROM: f32 = 0.1;
}

impl WidthInLanes for Beckmann<f32> {
    /// Even the first order alone takes less time in lanes.
    const LANES_FROM: f32 = 0.0;
}

pub(super) use with_ndf;
