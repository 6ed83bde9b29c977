//! Compiles OpenPBR's surface.

use super::super::material::{Layering, Leaf, Number, OpenPbr, Tint};
use super::{Compiler, MaterialError};
use crate::color::Rgb;
use crate::description as desc;
use crate::features::Features;

impl Compiler<'_> {
    pub(super) fn openpbr(&mut self, surface: &desc::OpenPbr) -> Result<Leaf, MaterialError> {
        let lookups = self.lookups;
        let used = |value: &desc::Scalar| *value != desc::Scalar::Value(0.0);
        let transmits = used(&surface.transmission_weight);
        let anisotropic = used(&surface.specular_roughness_anisotropy)
            || used(&surface.coat_roughness_anisotropy);
        let specular_ior = self.number(&surface.specular_ior)?;
        let opaque = surface.geometry_opacity == desc::Scalar::Value(1.0);
        let shines = used(&surface.emission_luminance);
        let features = Features::PRINCIPLED
            .with(Features::MIXES)
            .with(Features::METALS);
        self.need_if(features, true);
        self.need_walks();
        self.need_if(Features::TRANSPARENCY, !opaque);
        self.need_if(
            Features::DIFFUSE_FACETS.with(Features::BECKMANN),
            used(&surface.base_diffuse_roughness),
        );
        // What a light sample brings is not the mean then, but looked up.
        let fuzzy = used(&surface.fuzz_weight);
        self.need_if(Features::DIFFUSERS, fuzzy);
        let dimmed = !opaque || fuzzy || used(&surface.coat_weight);
        self.need_if(Features::VIEW_DEPENDENT, shines && dimmed);
        if surface.coat_darkening != desc::Scalar::Value(1.0) {
            self.note("by walks a coat darkens as it does: coat_darkening is left out");
        }
        let mut transmission_color = self.tint(&surface.transmission_color)?;
        match (
            self.number(&surface.transmission_depth)?,
            transmission_color,
        ) {
            (Number::Constant(0.0), _) => {}
            (Number::Constant(depth), Tint::Constant(color)) => {
                if transmits {
                    let color = color.max(Rgb::splat(f32::MIN_POSITIVE));
                    self.fill(color.map(|c| -c.ln() / depth))?;
                }
                transmission_color = Tint::Constant(Rgb::ONE);
            }
            _ => return Err(MaterialError::TexturedInterior),
        }
        let setup = self.setup_of(surface.tangent, !anisotropic, None, specular_ior, transmits)?;
        let mut leaf = OpenPbr {
            setup,
            base_weight: self.number(&surface.base_weight)?,
            base_color: self.tint(&surface.base_color)?,
            base_diffuse_roughness: self.number(&surface.base_diffuse_roughness)?,
            base_metalness: self.number(&surface.base_metalness)?,
            specular_weight: self.number(&surface.specular_weight)?,
            specular_color: self.tint(&surface.specular_color)?,
            specular_roughness: self.number(&surface.specular_roughness)?,
            specular_roughness_anisotropy: self.number(&surface.specular_roughness_anisotropy)?,
            specular_ior,
            transmission_weight: self.number(&surface.transmission_weight)?,
            transmission_color,
            coat_weight: self.number(&surface.coat_weight)?,
            coat_color: self.tint(&surface.coat_color)?,
            coat_roughness: self.number(&surface.coat_roughness)?,
            coat_roughness_anisotropy: self.number(&surface.coat_roughness_anisotropy)?,
            coat_ior: self.number(&surface.coat_ior)?,
            thin_film_weight: self.number(&surface.thin_film_weight)?,
            thin_film_thickness: self.number(&surface.thin_film_thickness)?,
            thin_film_ior: self.number(&surface.thin_film_ior)?,
            fuzz_weight: self.number(&surface.fuzz_weight)?,
            fuzz_color: self.tint(&surface.fuzz_color)?,
            fuzz_roughness: self.number(&surface.fuzz_roughness)?,
            emission_luminance: self.number(&surface.emission_luminance)?,
            emission_color: self.tint(&surface.emission_color)?,
            geometry_opacity: self.number(&surface.geometry_opacity)?,
        };
        leaf.setup.layering = Layering::walks(self.lookups == lookups);
        Ok(Leaf::OpenPbr(Box::new(leaf)))
    }
}
