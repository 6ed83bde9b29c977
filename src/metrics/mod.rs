//! How far two images are apart, and whether noise explains it.

/// The ε of relative errors, in squared radiance: errors of pixels darker than
/// √ε = 0.1 count less than their relative size.
pub const REL_EPSILON: f64 = 0.01;

/// The share of the largest values that robust means leave out.
pub const TRIM: f64 = 1e-3;

/// Mean of all but the largest [`TRIM`] of the values, which it reorders; NaN
/// when there are none. Of fewer than 1/[`TRIM`] values, all count.
pub fn trimmed_mean(values: &mut [f64]) -> f64 {
    let kept = values.len() - (values.len() as f64 * TRIM) as usize;
    if kept < values.len() {
        values.select_nth_unstable_by(kept, f64::total_cmp);
    }
    values[..kept].iter().sum::<f64>() / kept as f64
}
