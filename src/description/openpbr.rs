//! OpenPBR 1.1.1, by the names of its parameters.

use super::relief::{Bump, NormalMap, Relief};
use super::rough::Tangent;
use super::validate::{At, Check, Range};
use super::value::{Color, Scalar};
use serde::Deserialize;

/// Declares the parameters with their defaults and ranges.
macro_rules! parameters {
    ($($(#[$doc:meta])* $key:ident: $type:ident = $default:expr, $range:expr;)*) => {
        /// The surface of OpenPBR 1.1.1, without subsurface, scattering inside and
        /// dispersion.
        #[derive(Clone, Debug, PartialEq, Deserialize)]
        #[serde(default, deny_unknown_fields)]
        pub struct OpenPbr {
            /// Where the tangent comes from.
            pub tangent: Tangent,
            /// What replaces the interpolated normal.
            pub normal: Option<NormalMap>,
            /// What leans it.
            pub bump: Option<Bump>,
            $($(#[$doc])* pub $key: $type,)*
        }

        impl Default for OpenPbr {
            fn default() -> Self {
                Self {
                    tangent: Tangent::default(),
                    normal: None,
                    bump: None,
                    $($key: <$type>::from($default),)*
                }
            }
        }

        impl OpenPbr {
            pub(super) fn check(&self, check: &mut Check<'_, '_>, at: &At) {
                check.relief(Relief::of(&self.normal, &self.bump), at);
                $(parameters!(@$type check, &self.$key, $range, at.key(stringify!($key)));)*
            }
        }
    };
    (@Scalar $check:ident, $value:expr, $range:expr, $at:expr) => {
        $check.scalar($value, $range, $at)
    };
    (@Color $check:ident, $value:expr, $range:expr, $at:expr) => {
        $check.color($value, $range, $at)
    };
}

parameters! {
    /// A factor on `base_color`.
    base_weight: Scalar = 1.0, Range::UNIT;
    /// The albedo of the diffuse base, the reflectance of metal at normal incidence.
    base_color: Color = 0.8, Range::UNIT;
    /// The slope roughness of the diffuse facets.
    base_diffuse_roughness: Scalar = 0.0, Range::UNIT;
    /// How much of it is metal.
    base_metalness: Scalar = 0.0, Range::UNIT;
    /// A factor on the reflectance at normal incidence.
    specular_weight: Scalar = 1.0, Range::NonNegative;
    /// The colour of that reflectance, for metal at cosθ = 1/7.
    specular_color: Color = 1.0, Range::UNIT;
    /// √α.
    specular_roughness: Scalar = 0.3, Range::UNIT;
    /// 0 to 1, wider along the tangent.
    specular_roughness_anisotropy: Scalar = 0.0, Range::UNIT;
    /// Index of refraction, absolute.
    specular_ior: Scalar = 1.5, Range::Positive;
    /// How much of the base is clear.
    transmission_weight: Scalar = 0.0, Range::UNIT;
    /// The colour of what is let through, after `transmission_depth` or at each
    /// refraction.
    transmission_color: Color = 1.0, Range::UNIT;
    /// Metres after which `transmission_color` is left of what is let through; 0: at once.
    transmission_depth: Scalar = 0.0, Range::NonNegative;
    /// How much of a coat there is.
    coat_weight: Scalar = 0.0, Range::UNIT;
    /// What the coat lets through at normal incidence, there and back.
    coat_color: Color = 1.0, Range::UNIT;
    /// √α of the coat.
    coat_roughness: Scalar = 0.0, Range::UNIT;
    /// 0 to 1, wider along the tangent.
    coat_roughness_anisotropy: Scalar = 0.0, Range::UNIT;
    /// Index of refraction of the coat, absolute.
    coat_ior: Scalar = 1.6, Range::Positive;
    /// How far reflections inside of the coat darken the base; by walks they do.
    coat_darkening: Scalar = 1.0, Range::UNIT;
    /// How much of the base a thin film covers.
    thin_film_weight: Scalar = 0.0, Range::UNIT;
    /// Its thickness, µm.
    thin_film_thickness: Scalar = 0.5, Range::NonNegative;
    /// Index of refraction of the film, absolute.
    thin_film_ior: Scalar = 1.4, Range::Positive;
    /// How much fuzz there is.
    fuzz_weight: Scalar = 0.0, Range::UNIT;
    /// A factor on its light.
    fuzz_color: Color = 1.0, Range::UNIT;
    /// How loose its fibres are.
    fuzz_roughness: Scalar = 0.5, Range::UNIT;
    /// Luminance of what shines, cd·m⁻².
    emission_luminance: Scalar = 0.0, Range::NonNegative;
    /// Its colour.
    emission_color: Color = 1.0, Range::UNIT;
    /// How much does not go straight through.
    geometry_opacity: Scalar = 1.0, Range::UNIT;
}
