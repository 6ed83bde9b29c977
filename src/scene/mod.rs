//! The scene as it is rendered: immutable, indices for names, radiometric
//! quantities for the file's units, nothing that no ray asks for.

mod attributes;
mod compile;
mod error;
mod identity;
mod load;
mod material;
mod material_table;
mod placing;
mod resolve;
mod settings;
mod stage;
mod surface;
mod transform;

pub use attributes::Attributes;
pub use compile::{Compiled, MaterialError, Materials, Needs, compile_alone};
pub use error::ResolveError;
pub use load::Assets;
pub use material::{
    Bump, Facet, Factor, Ground, Leaf, Material, NormalMap, Number, Perturbation, Point,
    Reflectance, RoughMaterial, Roughness, Tangent, Tint, VertexColors, WeightedLeaf,
    blender_alphas,
};
pub use resolve::{Resolved, assemble, resolve, resolve_within};
pub use settings::{Limits, RenderSettings};
pub use stage::Stage;
pub use surface::{Surface, View};
pub use transform::{euler, to_affine};

use std::sync::Arc;

use glam::{Affine3A, Mat3A, Vec2, Vec3, Vec3A};

use crate::bsdf::Bsdf;
use crate::camera::Camera;
use crate::color::Rgb;
use crate::embree::{Accelerator, Hit, Ray, Vertices};
use crate::features::{Features, has};
use crate::light::{Lights, Receiver};
use crate::mesh::UvMap;
use crate::rays::RayKinds;
use crate::texture::Texture;

/// A mesh and what the scene needs of it.
#[derive(Debug)]
pub struct SceneMesh {
    /// Positions, metres: in world space if one object alone uses the mesh,
    /// else in the objects' own.
    pub vertices: Arc<Vertices>,
    /// Three vertices for each triangle, counter-clockwise from outside.
    pub triangles: Arc<Vec<[u32; 3]>>,
    /// A normal for each vertex, in the space of the positions.
    pub normals: Option<Vec<[f32; 3]>>,
    /// Texture coordinates for each vertex.
    pub uvs: Option<Vec<[f32; 2]>>,
    /// See [`crate::mesh::Mesh::tangents`]; in the objects' space, wherever the
    /// positions are.
    pub tangents: Option<Vec<[f32; 4]>>,
    /// Other texture coordinates by their number, see [`Attributes::uv_map`], from 1.
    pub uv_maps: Vec<Option<UvMap>>,
    /// Colours of vertices by their number, see [`Attributes::colors`].
    pub colors: Vec<Option<Vec<[f32; 3]>>>,
    /// For each triangle, which of the object's materials it has; all have the
    /// first without it.
    pub slots: Option<Vec<u16>>,
}

impl SceneMesh {
    /// The bytes that its vertices and triangles take.
    #[must_use]
    pub fn memory(&self) -> usize {
        size_of_val(&**self.vertices)
            + size_of_val(&**self.triangles)
            + self.normals.as_deref().map_or(0, size_of_val)
            + self.uvs.as_deref().map_or(0, size_of_val)
            + self.slots.as_deref().map_or(0, size_of_val)
            + self.attribute_bytes()
    }

    /// The bytes that tangents, UV maps and colours take.
    #[must_use]
    pub fn attribute_bytes(&self) -> usize {
        let tangents =
            |tangents: &Option<Vec<[f32; 4]>>| tangents.as_deref().map_or(0, size_of_val);
        let maps = self.uv_maps.iter().flatten();
        let maps = maps.map(|map| size_of_val(&*map.uvs) + tangents(&map.tangents));
        let colors = self
            .colors
            .iter()
            .flatten()
            .map(|colors| size_of_val(&**colors));
        tangents(&self.tangents) + maps.sum::<usize>() + colors.sum::<usize>()
    }

    /// The texture coordinates of this number.
    #[must_use]
    #[inline]
    pub fn uvs(&self, map: usize) -> Option<&[[f32; 2]]> {
        match map {
            0 => self.uvs.as_deref(),
            _ => Some(&self.uv_maps.get(map - 1)?.as_ref()?.uvs),
        }
    }

    /// The tangents along them.
    #[must_use]
    pub fn tangents(&self, map: usize) -> Option<&[[f32; 4]]> {
        match map {
            0 => self.tangents.as_deref(),
            _ => self.uv_maps.get(map - 1)?.as_ref()?.tangents.as_deref(),
        }
    }
}

/// Something to be seen.
#[derive(Debug)]
pub struct Object {
    /// For messages.
    pub name: String,
    /// Index of the mesh.
    pub mesh: usize,
    /// Where an instance stands; absent when the mesh is in world space.
    pub to_world: Option<Affine3A>,
    /// Takes normals from object space to world space; not normalised.
    pub normal_to_world: Mat3A,
    /// The inverse.
    pub normal_to_object: Mat3A,
    /// World space to the box round the mesh, each side from −½ to ½; there
    /// only when a material has a radial tangent.
    pub world_to_box: Option<Affine3A>,
    /// Whether the transform is a reflection, which turns triangles inside out.
    pub mirrored: bool,
    /// Material indices by slot.
    pub materials: Vec<usize>,
    /// The rays that meet it.
    pub seen_by: RayKinds,
    /// Whether it is a hole in the image.
    pub holdout: bool,
    /// For an emissive object, the number of its first triangle among the
    /// emissive triangles of all objects.
    pub first_emitter: Option<u32>,
}

/// All there is to render.
#[derive(Debug)]
pub struct Scene {
    /// The geometry; geometry `i` is object `i`.
    pub accelerator: Accelerator,
    /// Meshes.
    pub meshes: Vec<SceneMesh>,
    /// Objects.
    pub objects: Vec<Object>,
    /// For each emissive triangle, the index of its object.
    pub emitters: Vec<u32>,
    /// Materials.
    pub materials: Vec<Material>,
    /// Textures.
    pub textures: Vec<Texture>,
    /// All lights, the world among them.
    pub lights: Lights,
    /// The camera; measurements need none.
    pub camera: Option<Camera>,
    /// What the scene uses.
    pub features: Features,
}

impl Scene {
    /// The surface that `hit` on `ray` is on.
    #[must_use]
    #[inline]
    pub fn surface<const F: u32>(&self, ray: &Ray, hit: &Hit) -> Surface {
        let object_index = hit.geometry as usize;
        let object = &self.objects[object_index];
        let mesh = &self.meshes[object.mesh];
        let corners = mesh.triangles[hit.triangle as usize].map(|i| i as usize);
        let (w, u, v) = (1.0 - hit.u - hit.v, hit.u, hit.v);

        let place = |i: usize| {
            let p = Vec3A::from(mesh.vertices[i]);
            match &object.to_world {
                Some(to_world) if has::<F>(Features::INSTANCES) => to_world.transform_point3a(p),
                _ => p,
            }
        };
        let [a, b, c] = corners.map(place);
        let position = a * w + b * u + c * v;
        // An instance's vertices carry the rounding of their transform as well.
        let origin = match &object.to_world {
            Some(to_world) if has::<F>(Features::INSTANCES) => to_world.translation.abs(),
            _ => Vec3A::ZERO,
        };
        let error = Surface::position_error(Vec3::from(
            (a * w).abs() + (b * u).abs() + (c * v).abs() + origin,
        ));

        let cross = Vec3::from((b - a).cross(c - a));
        let outward = if object.mirrored { -cross } else { cross };
        // A triangle that rounds to no area has no side: face the viewer.
        let geometric = outward.try_normalize().unwrap_or(-ray.direction);
        let front = geometric.dot(ray.direction) <= 0.0;
        let geometric_normal = if front { geometric } else { -geometric };

        let mut uv = Vec2::ZERO;
        let mut along_u = Vec3::ZERO;
        let mut right_handed = true;
        if has::<F>(Features::TEXTURES) || has::<F>(Features::ANISOTROPY) {
            if let Some(uvs) = &mesh.uvs {
                let [ta, tb, tc] = corners.map(|i| Vec2::from(uvs[i]));
                uv = ta * w + tb * u + tc * v;
                if has::<F>(Features::ANISOTROPY) {
                    let (du, dv) = (tb - ta, tc - ta);
                    let area = du.perp_dot(dv);
                    along_u = Vec3::from(((b - a) * dv.y - (c - a) * du.y) * area.signum());
                    right_handed = ((area >= 0.0) != object.mirrored) == front;
                }
            }
        }
        let mut in_box = Vec3::ZERO;
        if has::<F>(Features::ANISOTROPY) {
            if let Some(to_box) = &object.world_to_box {
                in_box = Vec3::from(to_box.transform_point3a(position));
            }
        }

        let slot = mesh
            .slots
            .as_ref()
            .map_or(0, |slots| slots[hit.triangle as usize] as usize);
        let surface = Surface {
            position: Vec3::from(position),
            error,
            geometric_normal,
            normal: geometric_normal,
            front,
            uv,
            material: object.materials[slot],
            object: object_index,
            triangle: hit.triangle,
            weights: Vec2::new(u, v),
            footprint: 0.0,
            along_u,
            right_handed,
            in_box,
        };
        match &mesh.normals {
            Some(normals) if has::<F>(Features::SMOOTH_NORMALS) => {
                let [a, b, c] = corners.map(|i| Vec3A::from(normals[i]));
                let local = a * w + b * u + c * v;
                let world = match object.to_world {
                    Some(_) if has::<F>(Features::INSTANCES) => object.normal_to_world * local,
                    _ => local,
                };
                let world = Vec3::from(world).try_normalize().unwrap_or(geometric);
                surface.with_normal(if front { world } else { -world })
            }
            _ => surface,
        }
    }

    /// What light arrives at on a surface: among many lights, those on the
    /// viewer's side of an opaque one count.
    #[must_use]
    #[inline]
    pub fn receiver(&self, surface: &Surface) -> Receiver {
        let material = &self.materials[surface.material];
        let one_sided = self.lights.are_many() && !material.transmits();
        // Each closure has a horizon of its own there; all are above the true one.
        let normal = if material.is_perturbed() {
            surface.geometric_normal
        } else {
            surface.normal
        };
        Receiver {
            position: surface.position,
            normal: one_sided.then_some(normal),
        }
    }

    /// How many triangles rays can meet, each instance counted.
    #[must_use]
    pub fn triangles(&self) -> usize {
        self.objects
            .iter()
            .map(|o| self.meshes[o.mesh].triangles.len())
            .sum()
    }

    fn ground(&self, object: usize) -> Ground<'_> {
        let object = &self.objects[object];
        Ground {
            textures: &self.textures,
            on: Some((object, &self.meshes[object.mesh])),
        }
    }

    /// The shading normal that a noise filter takes, see [`Material::normal`].
    #[must_use]
    pub fn normal(&self, surface: &Surface, view: View) -> Vec3 {
        let point = Point::shaded(self.ground(surface.object), surface, view);
        self.materials[surface.material].normal(&point, surface)
    }

    /// Adds the closures at a surface point for who looks at it, for the features `F`.
    #[inline]
    pub fn add_closures<const F: u32>(&self, bsdf: &mut Bsdf<F>, surface: &Surface, view: View) {
        let material = &self.materials[surface.material];
        material.add_closures(bsdf, self.ground(surface.object), surface, view);
    }

    /// The radiance (W·m⁻²·sr⁻¹) of a point of an emissive triangle towards `wo`,
    /// given the triangle's number among those of all objects and barycentric
    /// weights of its second and third corner.
    #[must_use]
    pub fn emission_at(&self, emitter: u32, [u, v]: [f32; 2], wo: Vec3) -> Rgb {
        let index = self.emitters[emitter as usize];
        let object = &self.objects[index as usize];
        let Some(first) = object.first_emitter else {
            return Rgb::ZERO;
        };
        let triangle = (emitter - first) as usize;
        let mesh = &self.meshes[object.mesh];
        let slot = mesh
            .slots
            .as_ref()
            .map_or(0, |slots| slots[triangle] as usize);
        let corners = mesh.triangles[triangle].map(|i| i as usize);
        let uv = mesh.uvs.as_ref().map_or(Vec2::ZERO, |uvs| {
            let [a, b, c] = corners.map(|i| Vec2::from(uvs[i]));
            a * (1.0 - u - v) + b * u + c * v
        });
        let [a, b, c] = corners.map(|i| {
            let p = Vec3A::from(mesh.vertices[i]);
            object
                .to_world
                .map_or(p, |to_world| to_world.transform_point3a(p))
        });
        let cross = Vec3::from((b - a).cross(c - a));
        let outward = if object.mirrored { -cross } else { cross };
        let cos = outward.normalize_or_zero().dot(wo);
        let point = Point {
            ground: self.ground(index as usize),
            uv,
            triangle: emitter - first,
            weights: Vec2::new(u, v),
            cos: cos.abs(),
            front: cos >= 0.0,
            camera: false,
        };
        self.materials[object.materials[slot]].emission(&point)
    }

    /// The radiance that a surface point sends towards the viewer by itself,
    /// W·m⁻²·sr⁻¹.
    #[must_use]
    pub fn emission(&self, surface: &Surface, view: View) -> Rgb {
        let point = Point::shining(self.ground(surface.object), surface, view);
        self.materials[surface.material].emission(&point)
    }

    /// What a noise filter takes for the albedo of a surface point, see
    /// [`Material::albedo`].
    #[must_use]
    pub fn albedo(&self, surface: &Surface, view: View) -> Rgb {
        let point = Point::shaded(self.ground(surface.object), surface, view);
        self.materials[surface.material].albedo(&point)
    }
}
