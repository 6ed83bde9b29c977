//! The kernels: the path tracer, compiled for a few sets of features.

use crate::scene::{Features, Scene};

use super::render::{Job, render_pass};

/// Features of the plainest scenes: opaque surfaces, a pinhole.
const PLAIN: Features = Features::SMOOTH_NORMALS;
const LIT: Features = PLAIN
    .with(Features::LIGHT_SAMPLING)
    .with(Features::AREA_LIGHTS);
const OPAQUE: Features = LIT.with(Features::MULTIPLE_SCATTERING);
const GLASS: Features = OPAQUE.with(Features::TRANSMISSION);
const TEXTURED: Features = OPAQUE
    .with(Features::TEXTURES)
    .with(Features::ENVIRONMENT)
    .with(Features::ANISOTROPY)
    .with(Features::DEPTH_OF_FIELD);
const STUDIO: Features = TEXTURED
    .with(Features::TRANSMISSION)
    .with(Features::EMISSIVE_MESHES);
const EVERYTHING: Features = Features::from_bits(all_bits());

const fn all_bits() -> u32 {
    let mut bits = 0;
    let mut i = 0;
    while i < Features::ALL.len() {
        bits |= Features::ALL[i].0.bits();
        i += 1;
    }
    bits
}

type Pass = fn(&Job<'_>, &mut [crate::film::FilmTile]) -> u64;

/// Every kernel there is, from the leanest to the one with everything.
pub const KERNELS: &[Features] = &[PLAIN, LIT, OPAQUE, GLASS, TEXTURED, STUDIO, EVERYTHING];

/// The same list as code; the test below holds the two together.
const PASSES: &[Pass] = &[
    render_pass::<{ PLAIN.bits() }>,
    render_pass::<{ LIT.bits() }>,
    render_pass::<{ OPAQUE.bits() }>,
    render_pass::<{ GLASS.bits() }>,
    render_pass::<{ TEXTURED.bits() }>,
    render_pass::<{ STUDIO.bits() }>,
    render_pass::<{ EVERYTHING.bits() }>,
];

/// Index of the leanest kernel that has all of these features.
#[must_use]
pub fn kernel_for(features: Features) -> usize {
    KERNELS
        .iter()
        .position(|kernel| kernel.contains(features))
        .expect("the last kernel has everything")
}

/// The pass function for a scene, specialised or with everything in.
pub(super) fn pass_for(scene: &Scene, all_in: bool) -> (Features, Pass) {
    let index = if all_in {
        KERNELS.len() - 1
    } else {
        kernel_for(scene.features)
    };
    (KERNELS[index], PASSES[index])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kernels_grow_and_the_last_has_everything() {
        assert_eq!(KERNELS.len(), PASSES.len());
        assert!(Features::ALL.iter().all(|(f, ..)| EVERYTHING.contains(*f)));
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
