//! Walks that sample the BSDF.

use wide::{CmpGe, CmpGt, CmpLt, f32x8};

use super::math::{Directions, reflectance};
use super::ndf::phase;
use super::ndf::{NdfInLanes, NdfLanes};
use super::{LANES, survivors};
use crate::walk::Roulette;
use crate::{Conductor, Draw, Exit, Microsurface, Rgb, Vector3, enters};

impl<N: NdfInLanes> Microsurface<N, Conductor<f32>> {
    /// Eight times [`Microsurface::sample`], each with the [`Microsurface::pdf`] of its
    /// direction.
    pub fn sample_lanes(
        &self,
        wi: Vector3<f32>,
        rng: &mut impl Draw<f32x8>,
    ) -> [Option<(Exit<f32>, f32)>; LANES] {
        if !enters(wi) {
            return [None; LANES];
        }
        let (zero, one) = (f32x8::ZERO, f32x8::ONE);
        let ndf = self.ndf.in_lanes();
        let mut w = Directions::splat(wi);
        let [entrance, _] = ndf.projected_areas(w);
        let cos_i = w.z;
        let mut weight = [one; 3];
        let mut order = 0;
        let mut live = zero.cmp_ge(zero);
        // As in the scalar walk, a depth is drawn once it matters.
        let mut known = zero.cmp_gt(zero);
        let mut depth = zero;
        // What has left.
        let mut left = zero.cmp_gt(zero);
        let mut direction = w;
        let mut leaving = weight;
        let mut orders = zero;
        // The leading four numbers are stratified jointly, and so go to what tells the
        // most: the first facet, whether light leaves there, and half of the next facet.
        let mut facet = [rng.draw(), rng.draw()];
        let mut u = rng.draw();
        let mut half_of_next = rng.draw();
        loop {
            let m = ndf.sample_visible(w, facet);
            let (d, cos) = w.mirrored(m);
            for (weight, tint) in weight
                .iter_mut()
                .zip(reflectance(&self.facets.fresnel, cos))
            {
                *weight *= tint;
            }
            order += 1;
            let [_, back] = ndf.projected_areas(d);
            let rises = d.z.cmp_gt(zero);

            let entry = entrance * d.z;
            let chance = entry / (entry + cos_i * back);
            let escapes = !known & rises & u.cmp_lt(chance);

            let dives = !known & !rises;
            let free_path = |u: f32x8| -(one - u).ln();
            depth = dives.blend(free_path(u) * (cos_i / entrance), depth);
            known |= dives;
            let climb = free_path(rng.draw()) * d.z.abs();
            let emerges = known & rises & climb.cmp_ge(depth * back);
            let step = climb / back;
            depth = rises.blend((depth - step).fast_max(zero), depth + step);

            let leaves = live & (escapes | emerges);
            left |= leaves;
            direction = Directions {
                x: leaves.blend(d.x, direction.x),
                y: leaves.blend(d.y, direction.y),
                z: leaves.blend(d.z, direction.z),
            };
            for (leaving, weight) in leaving.iter_mut().zip(weight) {
                *leaving = leaves.blend(weight, *leaving);
            }
            orders = leaves.blend(f32x8::from(order as f32), orders);
            live &= !leaves;
            if live.none() {
                break;
            }
            live &= survivors(Roulette::OF_LIGHT, &mut weight, one, order, rng);
            if live.none() {
                break;
            }
            w = d.reversed();
            facet = [half_of_next, rng.draw()];
            u = rng.draw();
            half_of_next = rng.draw();
        }
        // As Microsurface::pdf has it for mirrors.
        let view = Directions::splat(wi);
        let folded = Directions {
            z: -direction.z,
            ..direction
        };
        let first = |o| phase(&ndf, view, entrance, o).0;
        let share = self.multiple_share();
        let lobe = direction.z * f32x8::FRAC_1_PI;
        let pdf = f32x8::from(1.0 - share) * (first(direction) + first(folded))
            + f32x8::from(share) * lobe;

        let pdf = pdf.to_array();
        let left = left.move_mask();
        let [x, y, z] = [direction.x, direction.y, direction.z].map(f32x8::to_array);
        let weights = leaving.map(f32x8::to_array);
        let orders = orders.to_array();
        std::array::from_fn(|lane| {
            let exit = Exit {
                direction: Vector3::new(x[lane], y[lane], z[lane]),
                weight: Rgb(weights.map(|channel| channel[lane])),
                order: orders[lane] as u32,
            };
            (left >> lane & 1 == 1).then_some((exit, pdf[lane]))
        })
    }
}
