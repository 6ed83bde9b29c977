//! Where the estimates of an evaluation go, order by order.

use super::{Real, Rgb};

/// Takes the estimates that an evaluation makes of each scattering order.
pub trait Tally<F> {
    /// Adds `value` (f |cosθ_o|, sr⁻¹) to scattering order `order` ≥ 1.
    fn add(&mut self, order: u32, value: Rgb<F>);
}

/// The sum of all orders.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Total<F>(pub Rgb<F>);

impl<F: Real> Tally<F> for Total<F> {
    #[inline]
    fn add(&mut self, _: u32, value: Rgb<F>) {
        self.0 += value;
    }
}

/// Single scattering and everything above it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Split<F> {
    /// The first order.
    pub single: Rgb<F>,
    /// The sum of orders ≥ 2.
    pub multiple: Rgb<F>,
}

impl<F: Real> Split<F> {
    /// The sum of all orders.
    #[inline]
    pub fn total(&self) -> Rgb<F> {
        self.single + self.multiple
    }
}

impl<F: Real> Tally<F> for Split<F> {
    #[inline]
    fn add(&mut self, order: u32, value: Rgb<F>) {
        if order <= 1 {
            self.single += value;
        } else {
            self.multiple += value;
        }
    }
}

/// Every order by itself: element k − 1 is order k.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PerOrder<F>(pub Vec<Rgb<F>>);

impl<F: Real> Tally<F> for PerOrder<F> {
    fn add(&mut self, order: u32, value: Rgb<F>) {
        let index = order.max(1) as usize - 1;
        if self.0.len() <= index {
            self.0.resize(index + 1, Rgb::black());
        }
        self.0[index] += value;
    }
}
