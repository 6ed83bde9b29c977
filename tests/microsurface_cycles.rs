//! Directional albedos against Blender's Cycles, measured there on the CPU
//! with a plane in a white world: 3.4.1, the last but few to walk, and 4.5,
//! whose single scattering is the model's.

use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use smithwalk::microsurface::*;

/// cosθ of the columns. Exactly normal incidence is no use: 3.4 takes it for a
/// smooth mirror.
const COSINES: [f64; 3] = [0.999, 0.5, 0.1];

/// Gold's green channel, its reflectance at each facet.
const GREEN: f64 = 0.71;

/// Blender's roughness (√α) and what Cycles 3.4.1 measures for Multiscatter
/// GGX, at [`COSINES`].
const CYCLES_3_4: [(f64, [f64; 3]); 4] = [
    (0.5, [0.6910, 0.6786, 0.6871]),
    (0.7, [0.6375, 0.6421, 0.6806]),
    (0.85, [0.5757, 0.6077, 0.6704]),
    (1.0, [0.5079, 0.5674, 0.6574]),
];

/// The same from an implementation of the exact model in numpy.
const EXACT: [(f64, [f64; 3]); 4] = [
    (0.5, [0.6908, 0.6782, 0.6869]),
    (0.7, [0.6352, 0.6392, 0.6798]),
    (0.85, [0.5677, 0.6014, 0.6685]),
    (1.0, [0.4916, 0.5566, 0.6548]),
];

/// White single scattering in Cycles 4.5, GGX.
const SINGLE_GGX: [(f64, [f64; 3]); 3] = [
    (0.5, [0.9157, 0.8571, 0.8916]),
    (0.7, [0.6977, 0.7039, 0.8620]),
    (1.0, [0.3070, 0.4505, 0.7602]),
];

/// And Beckmann.
const SINGLE_BECKMANN: (f64, [f64; 3]) = (1.0, [0.4622, 0.7666, 0.9528]);

/// Errors of the references: the worst of 336 albedos of Cycles that a walk
/// reproduced, and the rounding and noise of the others.
const CYCLES_ERROR: f64 = 0.0016;
const TABLE_ERROR: f64 = 0.0006;

const SAMPLES: usize = 500_000;

/// Five standard errors of our own: a false alarm in 6e-7 per albedo.
const SCORES: f64 = 5.0;

fn stream(seed: u64) -> Stream<Pcg64Mcg> {
    Stream(Pcg64Mcg::seed_from_u64(seed))
}

fn gold(roughness: f64) -> Microsurface<Ggx<f64>, Conductor<f64>> {
    let fresnel = ConductorFresnel::Constant(Rgb::splat(GREEN));
    Microsurface {
        ndf: Ggx::isotropic(roughness * roughness),
        facets: Conductor { fresnel },
    }
}

/// Mean and standard error of `SAMPLES` weights.
fn albedo(mut weight: impl FnMut() -> f64) -> (f64, f64) {
    let (mut sum, mut squares) = (0.0, 0.0);
    for _ in 0..SAMPLES {
        let x = weight();
        sum += x;
        squares += x * x;
    }
    let n = SAMPLES as f64;
    (sum / n, ((squares / n - (sum / n).powi(2)) / n).sqrt())
}

/// The walk as Cycles up to 3.6 has it: an upward ray that stays inside is put
/// at the top of the microsurface (C1 = 1), not where it collides.
fn cycles_walk(
    surface: &Microsurface<Ggx<f64>, Conductor<f64>>,
    wi: Vector3<f64>,
    rng: &mut Stream<Pcg64Mcg>,
) -> f64 {
    let mut draw = || -> f64 { rng.draw() };
    let (mut w, mut depth, mut weight) = (wi, 0.0, 1.0);
    loop {
        let sigma = surface.ndf.projected_area(w);
        let free = -(1.0 - draw()).ln() * w.z.abs() / sigma;
        if w.z >= 0.0 {
            depth += free;
        } else if free >= depth {
            return weight;
        } else {
            depth = 0.0;
        }
        let m = surface.ndf.sample_visible(w, [draw(), draw()]);
        w = -(m * (2.0 * w.dot(m)) - w);
        weight *= GREEN;
    }
}

#[test]
fn gold_is_darker_than_in_cycles_3_4_by_its_shortcut() {
    for ((roughness, cycles), (_, exact)) in CYCLES_3_4.into_iter().zip(EXACT) {
        let surface = gold(roughness);
        for ((cos, cycles), exact) in COSINES.into_iter().zip(cycles).zip(exact) {
            let wi = Vector3::spherical(cos, 0.0);
            let mut rng = stream(34);
            let (ours, error) = albedo(|| {
                surface
                    .sample(wi, &mut rng)
                    .map_or(0.0, |exit| exit.weight.0[1])
            });
            assert!(
                (ours - exact).abs() < TABLE_ERROR + SCORES * error,
                "r {roughness} cos {cos}: {ours} ± {error}, exact model {exact}"
            );
            let (shortcut, error) = albedo(|| cycles_walk(&surface, wi, &mut rng));
            assert!(
                (shortcut - cycles).abs() < CYCLES_ERROR + SCORES * error,
                "r {roughness} cos {cos}: {shortcut} ± {error}, Cycles 3.4 {cycles}"
            );
        }
    }
}

fn single<N: Ndf<f64>>(ndf: N, name: &str, expected: [f64; 3]) {
    let surface = Microsurface {
        ndf,
        facets: Conductor {
            fresnel: ConductorFresnel::Constant(Rgb::white()),
        },
    };
    let mut rng = stream(45);
    for (cos, expected) in COSINES.into_iter().zip(expected) {
        let wi = Vector3::spherical(cos, 0.0);
        let (ours, error) = albedo(|| {
            surface
                .sample_single(wi, &mut rng)
                .map_or(0.0, |exit| exit.weight.0[0])
        });
        assert!(
            (ours - expected).abs() < TABLE_ERROR + SCORES * error,
            "{name} cos {cos}: {ours} ± {error}, Cycles 4.5 {expected}"
        );
    }
}

#[test]
fn single_scattering_is_that_of_cycles_4_5() {
    for (roughness, expected) in SINGLE_GGX {
        single(
            Ggx::isotropic(roughness * roughness),
            &format!("GGX r {roughness}"),
            expected,
        );
    }
    let (roughness, expected) = SINGLE_BECKMANN;
    single(
        Beckmann::isotropic(roughness * roughness),
        "Beckmann",
        expected,
    );
}
