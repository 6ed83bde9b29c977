//! From what the file says of a material to what is rendered, and to what that
//! needs: names become indices, mixes flat lists, the estimator is chosen.

mod layered;
mod openpbr;
mod principled;
mod rough;
#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, BTreeSet};

use arrayvec::ArrayVec;

use super::attributes::Attributes;
use super::material::{
    Bump, Facet, Factor, Leaf, Material, NormalMap, Number, Perturbation, Tint, VertexColors,
    WeightedLeaf,
};
use crate::bsdf::MAX_CLOSURES;
use crate::color::Rgb;
use crate::description as desc;
use crate::features::Features;

/// What can keep a material that reads well from being rendered.
#[derive(Clone, Debug, thiserror::Error, PartialEq, Eq)]
pub enum MaterialError {
    /// Nested mixes with too many leaves.
    #[error("the mix comes to more than {MAX_CLOSURES} closures in all, the most there can be")]
    TooManyClosures,
    /// A name that is not among the materials.
    #[error("there is no material `{0}`")]
    UnknownMaterial(String),
    /// Slopes on a surface that is not made of facets.
    #[error(
        "`filter: slopes` is for `conductor`, `dielectric`, `refraction`, `rough_diffuse` and `diffuse` without roughness"
    )]
    NotRough,
    /// Colours of vertices where an image is needed.
    #[error("the texture `{0}` is no image: normals and heights come from images")]
    NoImage(String),
    /// A name that is not among the textures.
    #[error("there is no texture `{0}`")]
    UnknownTexture(String),
    /// A textured index of refraction where a table is made for each.
    #[error("the estimator `compensated` takes no texture for `ior`")]
    TexturedIndex,
    /// Something inside of a part of a material.
    #[error("a part of a mix has no inside of its own: put `filled` around the whole")]
    FilledPart,
    /// A texture where the inside of an object has one colour.
    #[error("with `transmission_depth` neither it nor `transmission_color` takes a texture")]
    TexturedInterior,
    /// Layers that no stack can be made of, and why.
    #[error("`layered`: {0}")]
    Stack(String),
}

/// What a material needs of everything else.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Needs {
    /// Whether it looks at texture coordinates.
    pub uvs: bool,
    /// Whether it looks along the axes of texture coordinates that normal maps have.
    pub tangents: bool,
    /// Other texture coordinates that it looks at, and whether along their axes.
    pub uv_maps: BTreeMap<String, bool>,
    /// Colours of vertices that it looks at.
    pub colors: BTreeSet<String>,
    /// What a kernel has to have.
    pub features: Features,
    /// What is rendered otherwise than the file says, for people.
    pub notes: Vec<&'static str>,
}

/// A material and what it needs.
#[derive(Clone, Debug)]
pub struct Compiled {
    /// As it is rendered.
    pub material: Material,
    /// What that takes.
    pub needs: Needs,
}

/// The materials of a file, each compiled when it is first asked for.
#[derive(Debug)]
pub struct Materials<'a> {
    described: &'a BTreeMap<String, desc::Material>,
    estimator: desc::Estimator,
    attributes: Attributes,
    known_textures: &'a BTreeMap<String, desc::Texture>,
    /// Names of the textures in use, by their index.
    textures: Vec<String>,
    /// Those of them whose slopes are averaged.
    filtered: BTreeSet<String>,
    compiled: BTreeMap<String, Result<Compiled, MaterialError>>,
}

impl<'a> Materials<'a> {
    /// Nothing compiled yet.
    #[must_use]
    pub fn of(description: &'a desc::Description) -> Self {
        Self {
            described: &description.materials,
            estimator: description.sampling.estimator,
            attributes: Attributes::of(description),
            known_textures: &description.textures,
            textures: Vec::new(),
            filtered: BTreeSet::new(),
            compiled: BTreeMap::new(),
        }
    }

    /// The material of this name; `None` if there is none.
    ///
    /// # Errors
    /// What keeps it from being rendered.
    pub fn get(&mut self, name: &str) -> Option<Result<&Compiled, MaterialError>> {
        if !self.compiled.contains_key(name) {
            let compiled = self.compile(self.described.get(name)?);
            self.compiled.insert(name.to_owned(), compiled);
        }
        let compiled = self.compiled.get(name)?;
        Some(compiled.as_ref().map_err(Clone::clone))
    }

    /// The names of all materials.
    pub fn names(&self) -> impl Iterator<Item = &'a str> + use<'a> {
        self.described.keys().map(String::as_str)
    }

    /// The numbers of UV maps and colours.
    #[must_use]
    pub fn attributes(&self) -> &Attributes {
        &self.attributes
    }

    /// Whether the slopes of a texture of this name are averaged.
    #[must_use]
    pub fn is_filtered(&self, texture: &str) -> bool {
        self.filtered.contains(texture)
    }

    /// Names of the textures that compiled materials look up, in the order of
    /// their indices.
    #[must_use]
    pub fn textures(&self) -> &[String] {
        &self.textures
    }

    fn compile(&mut self, material: &desc::Material) -> Result<Compiled, MaterialError> {
        let textured = self.textures.len();
        let mut compiler = Compiler {
            described: self.described,
            known_textures: Some(self.known_textures),
            estimator: self.estimator,
            attributes: self.attributes.clone(),
            textures: std::mem::take(&mut self.textures),
            filtered: BTreeSet::new(),
            needs: Needs::default(),
            leaves: Vec::new(),
            closures: 0,
            lookups: 0,
            interior: None,
            depth: 0,
        };
        let result = compiler.add(material, &Above::default());
        self.textures = std::mem::take(&mut compiler.textures);
        self.filtered.append(&mut compiler.filtered);
        if result.is_err() {
            self.textures.truncate(textured);
        }
        result.map(|()| compiler.finish())
    }
}

/// Compiles a material that names neither textures nor other materials.
///
/// # Errors
/// When it does, or when its mixes have too many leaves.
pub fn compile_alone(
    material: &desc::Material,
    estimator: desc::Estimator,
) -> Result<Material, MaterialError> {
    let mut compiler = Compiler {
        described: &BTreeMap::new(),
        known_textures: None,
        estimator,
        attributes: Attributes::default(),
        textures: Vec::new(),
        filtered: BTreeSet::new(),
        needs: Needs::default(),
        leaves: Vec::new(),
        closures: 0,
        lookups: 0,
        interior: None,
        depth: 0,
    };
    compiler.add(material, &Above::default())?;
    Ok(compiler.finish().material)
}

/// The product of mix factors above a material.
#[derive(Clone)]
struct Above {
    share: f32,
    factors: ArrayVec<(Factor, bool), MAX_CLOSURES>,
}

impl Default for Above {
    fn default() -> Self {
        Self {
            share: 1.0,
            factors: ArrayVec::new(),
        }
    }
}

impl Above {
    /// One level down, on the side of `b` or on that of `a`.
    fn below(&self, factor: Factor, is_b: bool) -> Result<Self, MaterialError> {
        let mut below = self.clone();
        match factor {
            Factor::Share(Number::Constant(f)) => below.share *= if is_b { f } else { 1.0 - f },
            _ => below
                .factors
                .try_push((factor, !is_b))
                .map_err(|_| MaterialError::TooManyClosures)?,
        }
        Ok(below)
    }
}

/// One material on its way.
struct Compiler<'a> {
    described: &'a BTreeMap<String, desc::Material>,
    known_textures: Option<&'a BTreeMap<String, desc::Texture>>,
    estimator: desc::Estimator,
    attributes: Attributes,
    textures: Vec<String>,
    filtered: BTreeSet<String>,
    needs: Needs,
    leaves: Vec<WeightedLeaf>,
    /// How many closures the leaves come to at the most.
    closures: usize,
    /// How often a texture has been asked for.
    lookups: usize,
    /// What the inside absorbs, m⁻¹.
    interior: Option<Rgb>,
    /// How many mixes and sums what is being compiled is inside of.
    depth: usize,
}

impl<'a> Compiler<'a> {
    fn finish(mut self) -> Compiled {
        let closures = self.leaves.len();
        self.need_if(Features::MIXES, closures > 1);
        let weighted = |l: &WeightedLeaf| l.share != 1.0 || !l.factors.is_empty();
        self.need_if(Features::MIXES, self.leaves.iter().any(weighted));
        Compiled {
            material: Material {
                leaves: self.leaves,
                interior: self.interior,
            },
            needs: self.needs,
        }
    }

    fn need_if(&mut self, features: Features, condition: bool) {
        self.needs.features.add_if(features, condition);
    }

    /// Adds the leaves of a material.
    fn add(&mut self, material: &desc::Material, above: &Above) -> Result<(), MaterialError> {
        let mut leaf = match material {
            desc::Material::Mix(mix) => {
                let factor = self.factor(&mix.factor)?;
                for (child, is_b) in [(&mix.a, false), (&mix.b, true)] {
                    let below = above.below(factor, is_b)?;
                    // A share of exactly zero never contributes.
                    if below.share > 0.0 {
                        self.add_part(child, &below)?;
                    }
                }
                return Ok(());
            }
            desc::Material::Sum(sum) => {
                self.add_part(&sum.a, above)?;
                return self.add_part(&sum.b, above);
            }
            desc::Material::Filled(filled) => {
                self.fill(Rgb::from(filled.interior.absorption()))?;
                return self.add(self.part(&filled.surface)?, above);
            }
            desc::Material::Conductor(conductor) => {
                let reflectance = self.metal(&conductor.reflectance)?;
                self.rough(&conductor.rough, Facet::Metal(reflectance))?
            }
            desc::Material::Dielectric(glass) => {
                let facet = Facet::Glass(self.number(&glass.ior)?, self.tint(&glass.color)?);
                self.rough(&glass.rough, facet)?
            }
            desc::Material::Refraction(glass) => {
                let facet = Facet::Refraction(self.number(&glass.ior)?, self.tint(&glass.color)?);
                self.need_if(Features::TRANSMISSION, true);
                self.rough(&glass.rough, facet)?
            }
            desc::Material::RoughDiffuse(matte) => {
                let facet = Facet::Matte(self.tint(&matte.color)?);
                self.rough(&matte.rough, facet)?
            }
            desc::Material::Diffuse(diffuse) => {
                let tint = self.tint(&diffuse.color)?;
                match self.number(&diffuse.roughness)? {
                    Number::Constant(0.0) => Leaf::Lambert(tint),
                    roughness => {
                        self.need_if(Features::DIFFUSERS, true);
                        Leaf::OrenNayar(tint, roughness, diffuse.version)
                    }
                }
            }
            desc::Material::Translucent(part) => {
                self.need_if(Features::DIFFUSERS, true);
                Leaf::Translucent(self.tint(&part.color)?)
            }
            desc::Material::Velvet(velvet) => {
                self.need_if(Features::DIFFUSERS, true);
                Leaf::Velvet(self.tint(&velvet.color)?, self.number(&velvet.sigma)?)
            }
            desc::Material::Sheen(sheen) => {
                self.need_if(Features::DIFFUSERS, true);
                Leaf::Sheen(self.tint(&sheen.color)?, self.number(&sheen.roughness)?)
            }
            desc::Material::Layered(layered) => self.layered(layered)?,
            desc::Material::Principled(node) => self.principled(node)?,
            desc::Material::OpenPbr(surface) => self.openpbr(surface)?,
            desc::Material::Emission(emission) => Leaf::Emission(
                self.tint(&emission.color)?,
                self.number(&emission.strength)?,
            ),
            desc::Material::Transparent(part) => {
                self.need_if(Features::TRANSPARENCY, true);
                Leaf::Transparent(self.tint(&part.color)?)
            }
        };
        self.closures += leaf.most_closures();
        if self.closures > MAX_CLOSURES {
            return Err(MaterialError::TooManyClosures);
        }
        let perturbation = self.perturbation(material, &mut leaf)?;
        self.leaves.push(WeightedLeaf {
            share: above.share,
            factors: above.factors.clone(),
            leaf,
            perturbation,
        });
        Ok(())
    }

    fn perturbation(
        &mut self,
        material: &desc::Material,
        leaf: &mut Leaf,
    ) -> Result<Option<Box<Perturbation>>, MaterialError> {
        let relief = material.relief();
        if relief.is_flat() {
            return Ok(None);
        }
        self.need_if(Features::NORMAL_MAPS, true);
        let normal = match relief.normal {
            None => None,
            Some(map) => {
                if map.space == desc::NormalSpace::Tangent {
                    match self.image(&map.texture)?.uv_map.clone() {
                        Some(uv_map) => drop(self.needs.uv_maps.insert(uv_map, true)),
                        None => self.needs.tangents = true,
                    }
                }
                let filtered = map.filter == desc::NormalFilter::Slopes;
                if filtered {
                    self.filter_slopes(&map.texture, leaf)?;
                }
                Some(NormalMap {
                    texture: self.texture(&map.texture)?,
                    filtered,
                    strength: self.number(&map.strength)?,
                    space: map.space,
                })
            }
        };
        let bump = match relief.bump {
            None => None,
            Some(bump) => {
                self.need_if(Features::FOOTPRINTS, true);
                Some(Bump {
                    texture: self.texture(&bump.texture)?,
                    channel: bump.channel,
                    strength: self.number(&bump.strength)?,
                    distance: self.number(&bump.distance)?,
                    sign: if bump.invert { -1.0 } else { 1.0 },
                    filter_width: bump.filter_width,
                })
            }
        };
        Ok(Some(Box::new(Perturbation { normal, bump })))
    }

    fn add_part(&mut self, part: &desc::MaterialRef, above: &Above) -> Result<(), MaterialError> {
        self.depth += 1;
        self.add(self.part(part)?, above)?;
        self.depth -= 1;
        Ok(())
    }

    /// Fills the inside with what absorbs this, m⁻¹.
    fn fill(&mut self, absorption: Rgb) -> Result<(), MaterialError> {
        if self.depth > 0 || self.interior.is_some() {
            return Err(MaterialError::FilledPart);
        }
        if absorption.max_element() > 0.0 {
            self.interior = Some(absorption);
            self.need_if(Features::ABSORPTION, true);
        }
        Ok(())
    }

    fn part<'b>(&self, part: &'b desc::MaterialRef) -> Result<&'b desc::Material, MaterialError>
    where
        'a: 'b,
    {
        match part {
            desc::MaterialRef::Inline(material) => Ok(material),
            desc::MaterialRef::Name(name) => {
                let described = self.described.get(name);
                described.ok_or_else(|| MaterialError::UnknownMaterial(name.clone()))
            }
        }
    }

    /// The texture of this name.
    fn described(&self, name: &str) -> Result<&'a desc::Texture, MaterialError> {
        let known = self.known_textures.and_then(|known| known.get(name));
        known.ok_or_else(|| MaterialError::UnknownTexture(name.to_owned()))
    }

    /// The same where it must be an image.
    fn image(&self, name: &str) -> Result<&'a desc::ImageTexture, MaterialError> {
        let image = self.described(name)?.image();
        image.ok_or_else(|| MaterialError::NoImage(name.to_owned()))
    }

    /// The index of an image.
    fn texture(&mut self, name: &str) -> Result<usize, MaterialError> {
        match &self.image(name)?.uv_map {
            Some(uv_map) => {
                self.need_if(Features::ATTRIBUTES, true);
                self.needs.uv_maps.entry(uv_map.clone()).or_default();
            }
            None => self.needs.uvs = true,
        }
        self.lookups += 1;
        if let Some(index) = self.textures.iter().position(|known| known == name) {
            return Ok(index);
        }
        self.textures.push(name.to_owned());
        Ok(self.textures.len() - 1)
    }

    /// The colours of vertices that a texture stands for.
    fn colors(&mut self, name: &str) -> Result<Option<VertexColors>, MaterialError> {
        let desc::Texture::Colors {
            colors,
            color_space,
        } = self.described(name)?
        else {
            return Ok(None);
        };
        self.need_if(Features::ATTRIBUTES, true);
        self.needs.colors.insert(colors.clone());
        self.lookups += 1;
        Ok(Some(VertexColors {
            set: self.attributes.colors(colors),
            color_space: *color_space,
        }))
    }

    fn number(&mut self, scalar: &desc::Scalar) -> Result<Number, MaterialError> {
        match scalar {
            desc::Scalar::Value(value) => Ok(Number::Constant(*value)),
            desc::Scalar::Texture { name, channel } => Ok(match self.colors(name)? {
                Some(colors) => Number::Colors(colors, *channel),
                None => Number::Texture(self.texture(name)?, *channel),
            }),
        }
    }

    fn tint(&mut self, color: &desc::Color) -> Result<Tint, MaterialError> {
        match color {
            desc::Color::Value(value) => Ok(Tint::Constant(Rgb::from(*value))),
            desc::Color::Texture(name) => Ok(match self.colors(name)? {
                Some(colors) => Tint::Colors(colors),
                None => Tint::Texture(self.texture(name)?),
            }),
        }
    }

    fn factor(&mut self, factor: &desc::Factor) -> Result<Factor, MaterialError> {
        let factor = match factor {
            desc::Factor::Share(share) => Factor::Share(self.number(share)?),
            desc::Factor::Fresnel { ior } => Factor::Fresnel(self.number(ior)?),
            desc::Factor::Facing { blend } => Factor::Facing(self.number(blend)?),
            desc::Factor::Backfacing => Factor::Backfacing,
            desc::Factor::CameraRay => Factor::CameraRay,
        };
        self.need_if(factor.features(), true);
        Ok(factor)
    }

    /// Keeps what people are told of a material that is rendered otherwise than
    /// it says.
    fn note(&mut self, note: &'static str) {
        if !self.needs.notes.contains(&note) {
            self.needs.notes.push(note);
        }
    }
}
