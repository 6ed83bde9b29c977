//! Walks and single scattering with the shortcuts that Cycles takes, to see
//! that they account for its difference from the model.

use smithwalk_model::*;

/// The most heights that Cycles' walk draws.
const ORDERS: u32 = 10;

/// A walk as Multiscatter GGX of Cycles up to 3.6 makes it. Against the model,
///
/// - an upward ray that does not escape collides at the top of the
///   microsurface, C1 = 1, and not where it would;
/// - a ray that crosses a facet keeps C1, which on the other side should be
///   1 − C1;
/// - directions within 0.8° of the normal count as the normal, those within
///   0.006° of the horizon stay at their height;
/// - nor are visible normals those of a tilted view unless it is by 0.8° after
///   stretching by α: smooth surfaces are always seen from the normal;
/// - what is still inside after ten heights is lost.
pub fn walk<I: Facets<Scalar = f64>>(
    surface: &Microsurface<Ggx<f64>, I>,
    wi: Vector3<f64>,
    rng: &mut impl Draw<f64>,
) -> Option<Exit<f64>> {
    let (mut direction, mut c1, mut side) = (-wi, 1.0_f64, Side::Above);
    let mut weight = Rgb::white();
    for order in 0..ORDERS {
        let (up, u) = (direction.z, rng.draw());
        let climbs = up > 1e-4;
        let lambda = surface.ndf.projected_area(-direction) / up.abs();
        if up > 0.9999 || (climbs && u > 1.0 - c1.powf(lambda)) {
            let out = if side == Side::Above { 1.0 } else { -1.0 };
            return Some(Exit {
                direction: direction * out,
                weight,
                order,
            });
        }
        if climbs {
            c1 = 1.0;
        } else if up < -0.9999 {
            c1 *= u;
        } else if up < -1e-4 {
            c1 *= (1.0 - u).powf(1.0 / lambda);
        }
        let m = surface
            .ndf
            .sample_visible(seen_from(surface.ndf, -direction), [rng.draw(), rng.draw()]);
        let bounce = surface.facets.scatter(side, -direction, m, rng);
        weight *= bounce.weight;
        direction = bounce.direction;
        if bounce.crosses {
            (direction, side) = (-direction, side.other());
        }
    }
    None
}

/// The direction from which a facet's normal is drawn.
fn seen_from(ndf: Ggx<f64>, w: Vector3<f64>) -> Vector3<f64> {
    let stretched = Vector3::new(ndf.alpha_x * w.x, ndf.alpha_y * w.y, w.z).normalized();
    if stretched.z > 0.9999 {
        Vector3::new(0.0, 0.0, 1.0)
    } else {
        w
    }
}

/// One bounce, weighted as Cycles from 4.0 on does: with the masking of
/// reflection, (1 + Λ_i)/(1 + Λ_i + Λ_o), for refraction too. There the model
/// has (1 + Λ_i) B(1 + Λ_i, 1 + Λ_o).
pub fn single<N: Ndf<Scalar = f64>, I: Facets<Scalar = f64>>(
    surface: &Microsurface<N, I>,
    wi: Vector3<f64>,
    rng: &mut impl Draw<f64>,
) -> Option<Exit<f64>> {
    let m = surface.ndf.sample_visible(wi, [rng.draw(), rng.draw()]);
    let bounce = surface.facets.scatter(Side::Above, wi, m, rng);
    let direction = bounce.direction;
    if bounce.crosses != (direction.z < 0.0) {
        return None;
    }
    let wo = if bounce.crosses {
        -direction
    } else {
        direction
    };
    let entry = 1.0 + surface.ndf.lambda(wi);
    Some(Exit {
        direction,
        weight: bounce.weight * (entry / (entry + surface.ndf.lambda(wo))),
        order: 1,
    })
}
