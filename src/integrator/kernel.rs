//! The kernels: the path tracer, compiled for a few sets of features.

use crate::features::Features;
use crate::film::FilmTile;
use crate::scene::Scene;

use super::pass::{Job, pilots, samples, training};
use super::path::{PathTracer, TrainingPath};
use super::roulette::Grid;
use super::split::{Cells, Pilot};

/// Lambertian surfaces under a constant world, or shining themselves: nothing
/// to sample.
const PLAIN: Features = Features::SMOOTH_NORMALS;
/// Under lamps; metals of single scattering.
const LIT: Features = PLAIN
    .with(Features::LIGHT_SAMPLING)
    .with(Features::AREA_LIGHTS)
    .with(Features::METALS);
/// The true model for metals.
const METAL: Features = LIT.with(Features::MULTIPLE_SCATTERING);
/// Metals and glass under a constant world, as in a furnace.
const FURNACE: Features = PLAIN
    .with(Features::INSTANCES)
    .with(Features::METALS)
    .with(Features::TRANSMISSION)
    .with(Features::MULTIPLE_SCATTERING);
/// Everything opaque under lamps.
const ROOM: Features = METAL
    .with(Features::INSTANCES)
    .with(Features::DIFFUSE_FACETS);
/// The same with glass.
const GLASS: Features = ROOM.with(Features::TRANSMISSION);
/// A textured object in an image of its surroundings.
const TEXTURED: Features = METAL
    .without(Features::AREA_LIGHTS)
    .with(Features::TEXTURES)
    .with(Features::ENVIRONMENT)
    .with(Features::ANISOTROPY);
/// What a scene from Blender is likely to have.
const STUDIO: Features = GLASS
    .with(TEXTURED)
    .with(Features::BECKMANN)
    .with(Features::MIXES)
    .with(Features::EMISSIVE_MESHES)
    .with(Features::DEPTH_OF_FIELD);
/// Opaque surfaces of Blender's node under anything that shines.
const NODES: Features = ROOM
    .without(Features::DIFFUSE_FACETS)
    .with(Features::TEXTURES)
    .with(Features::ENVIRONMENT)
    .with(Features::EMISSIVE_MESHES)
    .with(Features::DEPTH_OF_FIELD)
    .with(Features::MIXES)
    .with(Features::DIFFUSERS)
    .with(Features::PRINCIPLED);
/// The same with glass, what mixes make of it, and lamps that the camera does not see.
const HOME: Features = NODES
    .with(Features::TRANSMISSION)
    .with(Features::TRANSPARENCY)
    .with(Features::VIEW_DEPENDENT)
    .with(Features::RAY_VISIBILITY);
/// Opaque surfaces of that node by walks, and other stacks that nothing gets through.
const STACKS: Features = NODES.with(Features::LAYERS);
const EVERYTHING: Features = Features::EVERYTHING;

/// What a kernel does.
#[derive(Clone, Copy)]
pub(super) struct Kernel {
    /// Adds a job's samples to every tile; returns the rays traced.
    pub samples: fn(&Job<'_>, &mut [FilmTile]) -> u64,
    /// Traces the pilot paths of these cells.
    pub pilots: fn(&Job<'_>, &Cells) -> Vec<Pilot>,
    /// Traces the training paths of this grid.
    pub training: fn(&Job<'_>, &Grid) -> Vec<TrainingPath>,
}

impl Kernel {
    const fn new<const F: u32>() -> Self {
        Self {
            samples: |job, tiles| {
                samples(
                    &PathTracer::<F>::new(job.scene, job.settings, false),
                    job,
                    tiles,
                )
            },
            pilots: |job, cells| {
                pilots(
                    &PathTracer::<F>::new(job.scene, job.settings, true),
                    job,
                    cells,
                )
            },
            training: |job, grid| {
                training(
                    &PathTracer::<F>::new(job.scene, job.settings, false),
                    job,
                    grid,
                )
            },
        }
    }
}

/// Every kernel there is, from the leanest to the one with everything.
pub const KERNELS: &[Features] = &[
    PLAIN, LIT, METAL, FURNACE, ROOM, GLASS, TEXTURED, STUDIO, NODES, HOME, STACKS, EVERYTHING,
];

/// The same list as code; the test below holds the two together.
const CODE: &[Kernel] = &[
    Kernel::new::<{ PLAIN.bits() }>(),
    Kernel::new::<{ LIT.bits() }>(),
    Kernel::new::<{ METAL.bits() }>(),
    Kernel::new::<{ FURNACE.bits() }>(),
    Kernel::new::<{ ROOM.bits() }>(),
    Kernel::new::<{ GLASS.bits() }>(),
    Kernel::new::<{ TEXTURED.bits() }>(),
    Kernel::new::<{ STUDIO.bits() }>(),
    Kernel::new::<{ NODES.bits() }>(),
    Kernel::new::<{ HOME.bits() }>(),
    Kernel::new::<{ STACKS.bits() }>(),
    Kernel::new::<{ EVERYTHING.bits() }>(),
];

/// Index of the leanest kernel that has all of these features.
#[must_use]
pub fn kernel_for(features: Features) -> usize {
    KERNELS
        .iter()
        .position(|kernel| kernel.contains(features))
        .expect("the last kernel has everything")
}

/// The kernel for a scene, specialised or with everything in.
pub(super) fn for_scene(scene: &Scene, all_in: bool) -> (Features, Kernel) {
    let index = if all_in {
        KERNELS.len() - 1
    } else {
        kernel_for(scene.features)
    };
    (KERNELS[index], CODE[index])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kernels_grow_and_the_last_has_everything() {
        assert_eq!(KERNELS.len(), CODE.len());
        assert_eq!(kernel_for(Features::NONE), 0);
        assert_eq!(kernel_for(EVERYTHING), KERNELS.len() - 1);
        for pair in KERNELS.windows(2) {
            assert!(
                !pair[0].contains(pair[1]),
                "a later kernel would never be chosen"
            );
        }
    }
}
