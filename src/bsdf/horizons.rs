//! Shading normals that differ from the triangle's: a bijection between the
//! hemisphere that a closure scatters into and the one above the true surface.
//!
//! A closure knows the horizon of its shading normal n, light that of the true
//! normal g. Between the two horizons lies a lune of directions above the first and
//! below the second. Refusing them loses energy, letting them pass leaks light. Here
//! the closure's directions are squeezed away from the lune instead: in azimuth ψ
//! about the horizons' common axis n × g, counted from the horizon of n on the
//! lune's side, they are moved by
//!
//! ψ' = β + s ψ + (1 − s) ψ²/2S for ψ < S, ψ' = ψ beyond,
//!
//! with β the angle between the normals, S = min(3β, π), s = 1 − 2β/S. So the
//! closure's horizon ψ = 0 comes to lie on the true one, ψ' = β, and where no lune
//! is near nothing moves. Below the surface the same holds for −ω. As dω = db dψ,
//! with b the coordinate along the axis, densities change by dψ/dψ' alone.
//!
//! The closure is asked with both directions taken back, f(T⁻¹ω_o, T⁻¹ω_i), and its
//! value times the cosine is a density over ω_i, so:
//! - its integral over ω_i, the albedo, is that of the closure, whatever the closure;
//! - sampling, evaluation and density describe the same function;
//! - it is continuous, and a diffuse surface darkens to zero at the true horizon,
//!   where shadow begins;
//! - rays through matched media (η = 1) go straight on.
//!
//! Like every shading with a second normal (Veach 1997, section 5.3) it is reciprocal
//! up to a factor that depends on ω_i alone.

use glam::Vec3;

/// How far from the lune directions are moved, in units of the angle between the
/// normals. Densities grow by at most 1/s, 3 here: closer to 2, the factor is larger,
/// farther away, more directions are moved that no horizon cuts off.
const REACH: f32 = 3.0;

/// The least cosine between the normals; see [`within_reach`].
const MIN_COS: f32 = 0.05;

/// `normal` (unit length, the shading normal on the side of `geometric`), tilted
/// towards the geometric normal if it is more than 87° off: the squeeze has a limit
/// at 90°.
#[must_use]
pub fn within_reach(normal: Vec3, geometric: Vec3) -> Vec3 {
    let cos = normal.dot(geometric);
    if cos >= MIN_COS {
        return normal;
    }
    let across = (normal - geometric * cos).try_normalize();
    across.map_or(geometric, |across| {
        geometric * MIN_COS + across * (1.0 - MIN_COS * MIN_COS).sqrt()
    })
}

/// The direction of a viewer above the true surface as the closures of this shading
/// normal see it: what weighs them by their own albedo must know the same.
#[must_use]
pub fn seen_by_closures(shading: Vec3, geometric: Vec3, wo: Vec3) -> Vec3 {
    Horizons::new(shading, geometric).viewer(wo)
}

/// The horizons of a shading normal and of the true one; both normals are of unit
/// length, on the viewer's side, and [`within_reach`] of each other.
#[derive(Clone, Copy, Debug)]
pub(super) struct Horizons {
    shading: Vec3,
    geometric: Vec3,
    cos: f32,
}

/// A direction taken across, and the factor on densities there, dω/dω' from the
/// closure's directions to true ones.
pub(super) type Moved = (Vec3, f32);

impl Horizons {
    #[inline(always)]
    pub fn new(shading: Vec3, geometric: Vec3) -> Self {
        Self {
            shading,
            geometric,
            cos: shading.dot(geometric),
        }
    }

    /// From a closure's direction to the true one, T; on the same side of the true
    /// surface as `wi` is of the shading plane, up to rounding.
    #[inline(always)]
    pub fn lift(&self, wi: Vec3) -> Moved {
        let side = 1f32.copysign(wi.dot(self.shading));
        let up = wi * side;
        if !self.is_near(up.dot(self.shading), up.dot(self.geometric)) {
            return (wi, 1.0);
        }
        let (moved, density) = self.squeeze(up);
        (moved * side, density)
    }

    /// From a true direction to the closure's, T⁻¹; where the closure sends nothing,
    /// below its horizon and above the true one, `wi` itself with a factor of 0.
    #[inline(always)]
    pub fn lower(&self, wi: Vec3) -> Moved {
        let side = 1f32.copysign(wi.dot(self.geometric));
        let up = wi * side;
        let cos = up.dot(self.shading);
        if cos <= 0.0 {
            return (wi, 0.0);
        }
        if !self.is_near(cos, up.dot(self.geometric)) {
            return (wi, 1.0);
        }
        let (moved, density) = self.unsqueeze(up);
        (moved * side, density)
    }

    /// The direction of a viewer above the true surface as the closure sees it. Where
    /// the shading normal faces away from the viewer, the viewer is mirrored about its
    /// plane.
    #[inline(always)]
    pub fn viewer(&self, wo: Vec3) -> Vec3 {
        let cos = wo.dot(self.shading);
        let wo = if cos < 0.0 {
            wo - self.shading * (2.0 * cos)
        } else {
            wo
        };
        self.lower(wo).0
    }

    /// Whether a direction above the shading plane has ψ < S, from its cosines with
    /// both normals: sin(S − ψ) > 0, divided by sin β, for S = 3β ≤ π.
    #[inline(always)]
    fn is_near(&self, shading: f32, geometric: f32) -> bool {
        let c = self.cos;
        geometric * (4.0 * c * c - 1.0) < 2.0 * c * shading || c <= 0.5
    }

    #[cold]
    fn squeeze(&self, up: Vec3) -> Moved {
        let Some(lune) = Lune::between(self) else {
            return (up, 1.0);
        };
        let (a, c) = (up.dot(lune.across), up.dot(self.shading));
        let psi = c.atan2(-a);
        if psi >= lune.reach {
            return (up, 1.0);
        }
        let moved = lune.beta + psi * (lune.start + lune.bend * psi);
        let slope = lune.start + 2.0 * lune.bend * psi;
        (self.turn(&lune, up, [a, c], moved), slope.recip())
    }

    #[cold]
    fn unsqueeze(&self, up: Vec3) -> Moved {
        let Some(lune) = Lune::between(self) else {
            return (up, 1.0);
        };
        let (a, c) = (up.dot(lune.across), up.dot(self.shading));
        // The azimuth from the true horizon, where ψ' − β would cancel.
        let (sin, cos) = lune.beta.sin_cos();
        let above = up.dot(self.geometric).atan2(c * sin - a * cos).max(0.0);
        let slope = (lune.start * lune.start + 4.0 * lune.bend * above).sqrt();
        let psi = 2.0 * above / (lune.start + slope);
        if psi >= lune.reach {
            return (up, 1.0);
        }
        (self.turn(&lune, up, [a, c], psi), slope.recip())
    }

    /// `direction`, of these coordinates across the horizon and along the normal,
    /// turned about the axis to this azimuth.
    fn turn(&self, lune: &Lune, direction: Vec3, [a, c]: [f32; 2], azimuth: f32) -> Vec3 {
        let (sin, cos) = azimuth.sin_cos();
        let radius = a.hypot(c);
        direction + lune.across * (-radius * cos - a) + self.shading * (radius * sin - c)
    }
}

/// The lune between two horizons, and the squeeze beside it.
struct Lune {
    /// In the shading plane, away from the lune, across the axis.
    across: Vec3,
    /// Angle between the normals, β.
    beta: f32,
    /// Azimuth from which nothing moves, S.
    reach: f32,
    /// Slope at the horizon, s.
    start: f32,
    /// Half of the slope's own slope, (1 − s)/2S.
    bend: f32,
}

impl Lune {
    /// `None` between horizons that are one.
    fn between(horizons: &Horizons) -> Option<Self> {
        let axis = horizons.shading.cross(horizons.geometric);
        let across = axis.cross(horizons.shading).try_normalize()?;
        let beta = axis.length().atan2(horizons.cos);
        let reach = (REACH * beta).min(std::f32::consts::PI);
        let start = 1.0 - 2.0 * beta / reach;
        Some(Self {
            across,
            beta,
            reach,
            start,
            bend: (1.0 - start) / (2.0 * reach),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    fn direction(rng: &mut Pcg64Mcg) -> Vec3 {
        let z: f32 = rng.random_range(-1.0..1.0);
        let (sin, cos) = rng.random_range(0.0..std::f32::consts::TAU).sin_cos();
        let r = (1.0 - z * z).sqrt();
        Vec3::new(r * cos, r * sin, z)
    }

    /// Two normals `tilt` radians apart.
    fn tilted(tilt: f32, rng: &mut Pcg64Mcg) -> Horizons {
        let geometric = direction(rng);
        let (across, _) = geometric.any_orthonormal_pair();
        let (sin, cos) = tilt.sin_cos();
        Horizons::new(geometric * cos + across * sin, geometric)
    }

    const TILTS: [f32; 7] = [1e-4, 1e-2, 0.1, 0.4, 0.8, 1.1, 1.5];

    #[test]
    fn there_and_back_is_the_same_direction_on_the_true_side() {
        let mut rng = Pcg64Mcg::seed_from_u64(1);
        for tilt in TILTS {
            for _ in 0..2000 {
                let horizons = tilted(tilt, &mut rng);
                let wi = direction(&mut rng);
                let (moved, density) = horizons.lift(wi);
                let sides = wi.dot(horizons.shading) * moved.dot(horizons.geometric);
                assert!(sides > -1e-6, "{tilt}: {wi} and {moved}");
                assert!((moved.length() - 1.0).abs() < 1e-5);
                let (back, again) = horizons.lower(moved);
                assert!(again > 0.0, "{tilt}: {wi} has no way back from {moved}");
                assert!((back - wi).length() < 2e-4, "{tilt}: {wi} came back {back}");
                assert!((again / density - 1.0).abs() < 2e-2);
            }
        }
    }

    /// A rough count of what lands where, against the density: 7 tilts at 4 standard
    /// errors, a false alarm in 2000 seeds.
    #[test]
    fn densities_integrate_to_the_closures_hemisphere() {
        const N: u32 = 20_000;
        let mut rng = Pcg64Mcg::seed_from_u64(2);
        for tilt in TILTS {
            let (mut sum, mut squares) = (0.0, 0.0);
            for _ in 0..N {
                let horizons = tilted(tilt, &mut rng);
                let wi = direction(&mut rng);
                let up = wi.dot(horizons.geometric) > 0.0;
                let (back, density) = horizons.lower(wi);
                // Lambert's lobe about the shading normal.
                let lobe = 4.0 * f64::from(back.dot(horizons.shading) * density);
                let value = if up { lobe } else { 0.0 };
                sum += value;
                squares += value * value;
            }
            let n = f64::from(N);
            let mean = sum / n;
            let error = ((squares / n - mean * mean) / n).sqrt();
            assert!((mean - 1.0).abs() < 4.0 * error, "{tilt}: {mean} ± {error}");
        }
    }

    #[test]
    fn equal_normals_and_directions_far_from_the_lune_change_no_bit() {
        let mut rng = Pcg64Mcg::seed_from_u64(3);
        for _ in 0..1000 {
            let n = direction(&mut rng);
            let wi = direction(&mut rng);
            let flat = Horizons::new(n, n);
            assert_eq!(flat.lift(wi), (wi, 1.0));
            assert_eq!(flat.lower(wi), (wi, 1.0));
            let smooth = tilted(0.2, &mut rng);
            let up = smooth.shading;
            assert_eq!(smooth.lift(up), (up, 1.0), "0.2 rad is far from π/2");
        }
    }

    #[test]
    fn a_normal_past_the_horizon_is_tilted_back() {
        let away = Vec3::new(0.8, 0.0, -0.6);
        let tilted = within_reach(away, Vec3::Z);
        assert!((tilted.dot(Vec3::Z) - MIN_COS).abs() < 1e-6 && tilted.x > 0.99);
        assert_eq!(within_reach(-Vec3::Z, Vec3::Z), Vec3::Z);
        let near = Vec3::new(0.6, 0.0, 0.8);
        assert_eq!(within_reach(near, Vec3::Z), near);
    }
}
