//! Compiles Blender's Principled BSDF.

use super::super::material::{
    Facet, Layering, Leaf, Number, Principled3, Principled4, Reflectance, Setup, Tint,
};
use super::{Compiler, MaterialError};
use crate::bsdf::{Distribution, Method, Rises};
use crate::color::Rgb;
use crate::description as desc;
use crate::features::Features;

impl Compiler<'_> {
    pub(super) fn principled(&mut self, node: &desc::Principled) -> Result<Leaf, MaterialError> {
        self.need_if(
            Features::PRINCIPLED
                .with(Features::MIXES)
                .with(Features::METALS),
            true,
        );
        let lookups = self.lookups;
        let mut leaf = match &node.sockets {
            desc::Sockets::V3(sockets) => self.principled3(node, sockets)?,
            desc::Sockets::V4(sockets) => self.principled4(node, sockets)?,
        };
        if node.layering == desc::Layering::Walks {
            self.need_walks();
            let layering = Layering::walks(self.lookups == lookups);
            match &mut leaf {
                Leaf::Principled3(node) => node.setup.layering = layering,
                Leaf::Principled4(node) => node.setup.layering = layering,
                _ => {}
            }
        }
        Ok(leaf)
    }

    /// What both nodes share; `glass` is how the facets of glass scatter.
    fn setup(
        &mut self,
        node: &desc::Principled,
        isotropic: bool,
        once: Method,
        ior: Number,
        transmits: bool,
    ) -> Result<Setup, MaterialError> {
        let multiple = node.multiple || node.layering == desc::Layering::Walks;
        self.setup_of(
            node.tangent,
            isotropic,
            (!multiple).then_some(once),
            ior,
            transmits,
        )
    }

    /// How the facets of a node scatter: all orders, or `once`.
    pub(super) fn setup_of(
        &mut self,
        tangent: desc::Tangent,
        isotropic: bool,
        once: Option<Method>,
        ior: Number,
        transmits: bool,
    ) -> Result<Setup, MaterialError> {
        let white = Tint::Constant(Rgb::ONE);
        let (reflecting, glass) = if let Some(once) = once {
            (once, None)
        } else {
            let method = |facet| self.method(desc::Scattering::Multiple, Distribution::Ggx, facet);
            let reflecting = method(Facet::Metal(Reflectance::Constant(white)))?;
            let glass = if transmits {
                method(Facet::Glass(ior, white))?
            } else {
                Method::Single
            };
            (reflecting, Some(glass))
        };
        self.need_if(Features::MULTIPLE_SCATTERING, reflecting.is_multiple());
        self.need_if(
            Features::TRANSMISSION.with(Features::SPLIT_GLASS),
            transmits,
        );
        Ok(Setup {
            tangent: self.tangent(tangent, isotropic),
            reflecting,
            glass,
            rises: Rises::of_ggx(),
            layering: Layering::Cycles,
        })
    }

    fn principled3(
        &mut self,
        node: &desc::Principled,
        sockets: &desc::Principled3,
    ) -> Result<Leaf, MaterialError> {
        let alpha = self.number(&sockets.alpha)?;
        self.need_if(Features::TRANSPARENCY, !alpha.is(1.0));
        self.need_if(Features::DIFFUSERS, true);
        let anisotropic = self.number(&sockets.anisotropic)?;
        let ior = self.number(&sockets.ior)?;
        let transmission = self.number(&sockets.transmission)?;
        let subsurface = self.number(&sockets.subsurface)?;
        if node.layering == desc::Layering::Walks
            && sockets.transmission_roughness != desc::Scalar::Value(0.0)
        {
            self.note(
                "by walks an interface has one roughness: transmission_roughness is left out",
            );
        }
        if !subsurface.is(0.0) {
            self.note("subsurface scattering is a diffuse base of the same colour");
        }
        let transmits = !transmission.is(0.0);
        let setup = self.setup(node, anisotropic.is(0.0), Method::Separable, ior, transmits)?;
        let emission_strength = self.number(&sockets.emission_strength)?;
        let shines = sockets.emission != desc::Color::Value([0.0; 3]) && !emission_strength.is(0.0);
        // What a light sample brings is not the mean then, but looked up.
        self.need_if(Features::VIEW_DEPENDENT, shines && !alpha.is(1.0));
        Ok(Leaf::Principled3(Box::new(Principled3 {
            setup,
            base_color: self.tint(&sockets.base_color)?,
            subsurface,
            subsurface_color: self.tint(&sockets.subsurface_color)?,
            metallic: self.number(&sockets.metallic)?,
            specular: self.number(&sockets.specular)?,
            specular_tint: self.number(&sockets.specular_tint)?,
            roughness: self.number(&sockets.roughness)?,
            anisotropic,
            anisotropic_rotation: self.number(&sockets.anisotropic_rotation)?,
            sheen: self.number(&sockets.sheen)?,
            sheen_tint: self.number(&sockets.sheen_tint)?,
            clearcoat: self.number(&sockets.clearcoat)?,
            clearcoat_roughness: self.number(&sockets.clearcoat_roughness)?,
            ior,
            transmission,
            transmission_roughness: self.number(&sockets.transmission_roughness)?,
            emission: self.tint(&sockets.emission)?,
            emission_strength,
            alpha,
        })))
    }

    fn principled4(
        &mut self,
        node: &desc::Principled,
        sockets: &desc::Principled4,
    ) -> Result<Leaf, MaterialError> {
        let alpha = self.number(&sockets.alpha)?;
        self.need_if(Features::TRANSPARENCY, !alpha.is(1.0));
        let anisotropic = self.number(&sockets.anisotropic)?;
        let ior = self.number(&sockets.ior)?;
        let transmission_weight = self.number(&sockets.transmission_weight)?;
        let diffuse_roughness = self.number(&sockets.diffuse_roughness)?;
        let facets = Features::DIFFUSE_FACETS.with(Features::BECKMANN);
        let rough = match node.layering {
            desc::Layering::Cycles => Features::DIFFUSERS,
            desc::Layering::Walks => facets,
        };
        self.need_if(rough, !diffuse_roughness.is(0.0));
        if sockets.subsurface_weight != desc::Scalar::Value(0.0) {
            self.note("subsurface scattering is a diffuse base of the same colour");
        }
        let thin_film_thickness = self.number(&sockets.thin_film_thickness)?;
        if !(node.filmed_metal || thin_film_thickness.is(0.0))
            && sockets.metallic != desc::Scalar::Value(0.0)
        {
            self.note("a thin film on metal is left out, as the node had none before 5.0");
        }
        let sheen_weight = self.number(&sockets.sheen_weight)?;
        self.need_if(Features::DIFFUSERS, !sheen_weight.is(0.0));
        let transmits = !transmission_weight.is(0.0);
        let setup = self.setup(node, anisotropic.is(0.0), Method::Single, ior, transmits)?;
        let leaf = Principled4 {
            setup,
            base_color: self.tint(&sockets.base_color)?,
            metallic: self.number(&sockets.metallic)?,
            roughness: self.number(&sockets.roughness)?,
            ior,
            alpha,
            diffuse_roughness,
            specular_ior_level: self.number(&sockets.specular_ior_level)?,
            specular_tint: self.tint(&sockets.specular_tint)?,
            anisotropic,
            anisotropic_rotation: self.number(&sockets.anisotropic_rotation)?,
            transmission_weight,
            coat_weight: self.number(&sockets.coat_weight)?,
            coat_roughness: self.number(&sockets.coat_roughness)?,
            coat_ior: self.number(&sockets.coat_ior)?,
            coat_tint: self.tint(&sockets.coat_tint)?,
            thin_film_thickness,
            thin_film_ior: self.number(&sockets.thin_film_ior)?,
            filmed_metal: node.filmed_metal,
            sheen_weight,
            sheen_roughness: self.number(&sockets.sheen_roughness)?,
            sheen_tint: self.tint(&sockets.sheen_tint)?,
            emission_color: self.tint(&sockets.emission_color)?,
            emission_strength: self.number(&sockets.emission_strength)?,
        };
        // What a light sample brings is not the mean then, but looked up.
        let dimmed = leaf.is_covered() || !leaf.alpha.is(1.0);
        let shines = !leaf.emission_strength.is(0.0);
        self.need_if(Features::VIEW_DEPENDENT, shines && dimmed);
        Ok(Leaf::Principled4(Box::new(leaf)))
    }
}
