//! What a scene uses, so that the rest can be left out.

/// A set of features. The integrator is compiled for a few such sets (see
/// [`crate::integrator`]); code for a feature outside of the set is not there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Features(u32);

/// Declares the features with their bit, their name and what each costs.
macro_rules! features {
    ($($(#[$doc:meta])* $constant:ident = $bit:literal, $name:literal, $cost:literal;)*) => {
        impl Features {
            $($(#[$doc])* pub const $constant: Self = Self(1 << $bit);)*

            /// Every feature with its name and what it costs a scene that has it.
            pub const ALL: &[(Self, &str, &str)] = &[$((Self::$constant, $name, $cost),)*];
        }
    };
}

features! {
    /// Image textures on materials.
    TEXTURES = 0, "textures", "UVs in memory, a look-up per textured value and hit";
    /// A world image, sampled by importance.
    ENVIRONMENT = 1, "environment map", "the image and a sampling table of its size, a look-up per ray that leaves";
    /// Anything that light samples can connect to.
    LIGHT_SAMPLING = 2, "light sampling", "a shadow ray, a BSDF value and a proxy density per hit";
    /// Light shapes that rays can meet: areas, spheres, suns with a disk.
    AREA_LIGHTS = 3, "area lights", "a search along each ray";
    /// Meshes with emission.
    EMISSIVE_MESHES = 4, "emissive meshes", "a table of their triangles";
    /// Dielectric closures.
    TRANSMISSION = 5, "transmission", "dielectric closures in the kernel";
    /// Microsurface walks of more than one facet.
    MULTIPLE_SCATTERING = 6, "multiple scattering", "random walks in sampling and evaluation";
    /// Roughness that differs by direction.
    ANISOTROPY = 7, "anisotropy", "a tangent per hit";
    /// Materials of more than one closure.
    MIXES = 8, "mixes", "up to sixteen closures per hit";
    /// Surfaces that let light straight through.
    TRANSPARENCY = 9, "transparent shadows", "shadow rays that step through surfaces";
    /// A camera with an aperture.
    DEPTH_OF_FIELD = 10, "depth of field", "a lens sample per camera ray";
    /// Meshes that several objects share.
    INSTANCES = 11, "instances", "a second level in the hierarchy, a transform per hit";
    /// Interpolated normals.
    SMOOTH_NORMALS = 12, "smooth normals", "normals in memory, an interpolation per hit";
    /// Objects, lights or a world that some kinds of rays pass.
    RAY_VISIBILITY = 13, "ray visibility", "a mask per ray, the kind of every scattered one";
    /// Conductor closures, mirrors among them.
    METALS = 14, "metals", "conductor closures in the kernel";
    /// Microsurfaces of Lambertian facets.
    DIFFUSE_FACETS = 15, "diffuse facets", "closures of theirs in the kernel";
    /// Facets with Gaussian slopes.
    BECKMANN = 16, "Beckmann slopes", "a second distribution in every rough closure";
    /// Dielectric facets whose reflection and transmission are apart.
    SPLIT_GLASS = 17, "glass in parts", "refraction alone, and glass with two colours, in the kernel";
    /// Wide lobes other than Lambert's on the viewer's side.
    DIFFUSERS = 18, "other diffuse lobes", "rough diffuse, translucent, velvet and sheen closures in the kernel";
    /// Weights of mixes, or emission, that depend on who looks.
    VIEW_DEPENDENT = 19, "view-dependent mixes", "Fresnel's factor, facing and the like per hit";
    /// Blender's node.
    PRINCIPLED = 20, "principled", "the node's layers put together per hit";
    /// Stacks of interfaces.
    LAYERS = 21, "layers", "walks among interfaces in sampling and evaluation";
    /// Objects that are filled with something that absorbs.
    ABSORPTION = 22, "absorption", "the media that a path is in, and what they leave of it, per ray";
    /// Facets with the normals of the quadratic distribution.
    QUADRATIC = 23, "quadratic normals", "a third distribution in every rough closure";
    /// Normals out of textures.
    NORMAL_MAPS = 24, "normal maps", "tangents in memory, a normal per closure";
    /// UV maps beside meshes' first ones, and colours of vertices.
    ATTRIBUTES = 25, "UV maps and vertex colours", "what they say of each vertex in memory, an interpolation per look-up";
    /// How wide the surface is that a pixel sees.
    FOOTPRINTS = 26, "footprints", "a cone along each path";
}

impl Features {
    /// None.
    pub const NONE: Self = Self(0);

    /// All.
    pub const EVERYTHING: Self = {
        let mut all = Self::NONE;
        let mut i = 0;
        while i < Self::ALL.len() {
            all = all.with(Self::ALL[i].0);
            i += 1;
        }
        all
    };

    /// The set with exactly these bits.
    #[must_use]
    pub const fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    /// The bits, for use as a const parameter.
    #[must_use]
    pub const fn bits(self) -> u32 {
        self.0
    }

    /// Both sets together.
    #[must_use]
    pub const fn with(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// This set without the other.
    #[must_use]
    pub const fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    /// Whether all of `other` is in this set.
    #[must_use]
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// Adds `other` where `condition` holds.
    pub fn add_if(&mut self, other: Self, condition: bool) {
        if condition {
            self.0 |= other.0;
        }
    }

    /// How many features are in the set.
    #[must_use]
    pub const fn len(self) -> u32 {
        self.0.count_ones()
    }

    /// Whether there are none.
    #[must_use]
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }
}

/// Whether the feature set `F` of a monomorphised function has `feature`.
#[must_use]
#[inline(always)]
pub const fn has<const F: u32>(feature: Features) -> bool {
    Features::from_bits(F).contains(feature)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_feature_has_a_bit_of_its_own() {
        let all = Features::EVERYTHING;
        assert_eq!(all.len() as usize, Features::ALL.len());
        assert!(
            all.contains(Features::MIXES)
                && !all.without(Features::MIXES).contains(Features::MIXES)
        );
    }
}
