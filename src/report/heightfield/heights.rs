//! Where rays hit: the heights that are visible along a direction.

use glam::DVec3;
use rayon::prelude::*;

use super::departure::{Departure, Distance, Estimate};
use super::field::{Patch, Random, stream};
use super::trace::{Flight, Meeting};
use super::{Config, HeightFieldError};
use smithwalk_model::heights::{Gaussian, Heights};
use smithwalk_model::{Beckmann, Draw, Ndf, Side, Vector3};

/// Bins of the histograms of heights.
const BINS: usize = 60;

/// They cover heights from −`RANGE` to `RANGE`; what lies beyond counts in the
/// outermost ones, on the surface and in the model alike.
const RANGE: f64 = 3.0;

/// Where rays begin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Start {
    /// Above the highest point.
    Outside,
    /// At this height (RMS heights), uniformly in the space that is free there.
    Inside(f64),
}

/// One histogram of visible heights.
#[derive(Clone, Debug, PartialEq)]
pub struct HeightCase {
    /// What is looked at, in words.
    pub name: &'static str,
    /// Slope roughness of the surface, along x and y alike.
    pub alpha: f64,
    /// Where rays begin.
    pub start: Start,
    /// The z of their unit direction of travel, in the xz plane towards +x.
    pub travel_z: f64,
    /// Edges of the bins, in RMS heights; one more than bins.
    pub edges: Vec<f64>,
    /// Density of the heights of hits on the surface, per RMS height.
    pub surface: Vec<Estimate>,
    /// The same predicted by the model, averaged over each bin.
    pub model: Vec<f64>,
    /// The share of rays that hit anything, on the surface.
    pub hits: Estimate,
    /// The same predicted by the model.
    pub hits_model: f64,
    /// Kolmogorov–Smirnov distance of the heights of hits.
    pub heights: Departure,
    /// Difference of the shares of rays that hit.
    pub reach: Departure,
    /// Rays that rounding lost, of all that were traced.
    pub lost: u64,
}

/// What defines a case, and the departure that long runs found for it.
struct Setting {
    name: &'static str,
    start: Start,
    travel_z: f64,
    /// Of heights, and of the share of hits.
    tabulated: [f64; 2],
}

const NORMAL: &str = "from outside, normal incidence";
const TILTED: &str = "from outside, tilted";
const DOWN: &str = "from inside, going down";
const UP: &str = "from inside, going up";

/// Slope roughness of the surface. One is enough: stretching surface and rays
/// together leaves heights alone, so these depend on α tanθ and nothing else.
const ALPHA: f64 = 1.0;

/// The four cases of the talk, at several slants.
const SETTINGS: [Setting; 9] = [
    setting(NORMAL, Start::Outside, -1.0, [0.004, 0.0]),
    setting(TILTED, Start::Outside, -0.7, [0.006, 0.0]),
    setting(TILTED, Start::Outside, -0.3, [0.034, 0.0]),
    setting(TILTED, Start::Outside, -0.1, [0.026, 0.0]),
    setting(DOWN, Start::Inside(0.0), -0.7, [0.009, 0.0]),
    setting(DOWN, Start::Inside(0.0), -0.3, [0.056, 0.0]),
    setting(UP, Start::Inside(0.0), 0.7, [0.042, 0.006]),
    setting(UP, Start::Inside(0.0), 0.3, [0.027, 0.054]),
    setting(UP, Start::Inside(0.0), 0.1, [0.061, 0.053]),
];

const fn setting(name: &'static str, start: Start, travel_z: f64, tabulated: [f64; 2]) -> Setting {
    Setting {
        name,
        start,
        travel_z,
        tabulated,
    }
}

impl Setting {
    fn direction(&self) -> DVec3 {
        DVec3::new(
            (1.0 - self.travel_z * self.travel_z).sqrt(),
            0.0,
            self.travel_z,
        )
    }

    /// The model's distribution function of the heights of hits.
    ///
    /// Collisions come at the rate r = σ(−d)/|d_z| per unit of τ = −ln C1, so
    /// going down from C0 = C1(h₀) (1 outside) a hit is below h with the
    /// chance (C1(h)/C0)^r. Going up it is above h, or nothing is hit, with
    /// the chance (C0/C1(h))^r; that of no hit is C0^r.
    fn below(&self, height: f64) -> f64 {
        let (rate, from) = self.rate_and_start();
        let at: f64 = Gaussian.below(height);
        if self.travel_z < 0.0 {
            (at / from).min(1.0).powf(rate)
        } else {
            (1.0 - (from / at.max(from)).powf(rate)) / self.hits()
        }
    }

    /// The model's chance of a hit.
    fn hits(&self) -> f64 {
        let (rate, from) = self.rate_and_start();
        if self.travel_z < 0.0 {
            1.0
        } else {
            1.0 - from.powf(rate)
        }
    }

    fn rate_and_start(&self) -> (f64, f64) {
        let d = self.direction();
        let sigma = Beckmann::isotropic(ALPHA).projected_area(Vector3::new(-d.x, -d.y, -d.z));
        let from = match self.start {
            Start::Outside => 1.0,
            Start::Inside(height) => Gaussian.below(height),
        };
        (sigma / d.z.abs(), from)
    }

    /// Hits by bin, and rays lost.
    fn trace(&self, patch: &Patch, rays: usize, rng: &mut Random) -> Batch {
        let mut batch = Batch {
            bins: vec![0.0; BINS],
            hits: 0.0,
            lost: 0,
        };
        for _ in 0..rays {
            let mut flight = Flight {
                position: self.origin(patch, rng),
                direction: self.direction(),
                side: Side::Above,
            };
            match patch.meet(&mut flight) {
                Meeting::Facet(_) => {
                    let bin = (flight.position.z + RANGE) * (BINS as f64 / (2.0 * RANGE));
                    batch.bins[(bin.max(0.0) as usize).min(BINS - 1)] += 1.0;
                    batch.hits += 1.0;
                }
                Meeting::Out => {}
                Meeting::Lost => batch.lost += 1,
            }
        }
        batch
    }

    fn origin(&self, patch: &Patch, rng: &mut Random) -> DVec3 {
        loop {
            let place = patch.on_top([rng.draw(), rng.draw()]);
            let Start::Inside(height) = self.start else {
                return place;
            };
            let mut probe = Flight {
                position: place,
                direction: DVec3::NEG_Z,
                side: Side::Above,
            };
            if patch.meet(&mut probe) != Meeting::Lost && probe.position.z < height {
                return place.with_z(height);
            }
        }
    }

    fn case(&self, batches: &[Batch], rays: usize) -> HeightCase {
        let width = 2.0 * RANGE / BINS as f64;
        let edges: Vec<f64> = (0..=BINS).map(|i| -RANGE + width * i as f64).collect();
        let below: Vec<f64> = (0..=BINS)
            .map(|i| match i {
                0 => 0.0,
                BINS => 1.0,
                _ => self.below(edges[i]),
            })
            .collect();
        let model: Vec<f64> = below.windows(2).map(|c| c[1] - c[0]).collect();
        let differences: Vec<Vec<f64>> = batches
            .iter()
            .map(|b| {
                b.bins
                    .iter()
                    .zip(&model)
                    .map(|(n, m)| n / b.hits - m)
                    .collect()
            })
            .collect();
        let reach: Vec<Vec<f64>> = batches
            .iter()
            .map(|b| b.hits / rays as f64 - self.hits())
            .map(|d| vec![d, -d])
            .collect();
        let [heights, hits] = self.tabulated;
        HeightCase {
            name: self.name,
            alpha: ALPHA,
            start: self.start,
            travel_z: self.travel_z,
            surface: (0..BINS)
                .map(|i| Estimate::of(batches.iter().map(|b| b.bins[i] / (b.hits * width))))
                .collect(),
            model: model.iter().map(|m| m / width).collect(),
            hits: Estimate::of(batches.iter().map(|b| b.hits / rays as f64)),
            hits_model: self.hits(),
            heights: Departure::new(&differences, Distance::Kolmogorov, heights),
            reach: Departure::new(&reach, Distance::TotalVariation, hits),
            lost: batches.iter().map(|b| b.lost).sum(),
            edges,
        }
    }
}

/// The hits of one realisation.
struct Batch {
    bins: Vec<f64>,
    hits: f64,
    lost: u64,
}

/// The heights at which rays hit the surface, and the model's prediction, in
/// the talk's four cases: seen from above all heights show; tilted, the high
/// ones more; from inside nothing shows above the start going down, and
/// nothing below it going up.
///
/// # Errors
/// When Embree is missing or out of memory, or `config` makes no surface.
pub fn visible_heights(config: &Config) -> Result<Vec<HeightCase>, HeightFieldError> {
    config.check()?;
    let mut batches: Vec<Vec<Batch>> = SETTINGS.iter().map(|_| Vec::new()).collect();
    config.over_patches(&[[ALPHA; 2]], |realisation, _, patch| {
        let here: Vec<(usize, Batch)> = SETTINGS
            .par_iter()
            .enumerate()
            .map(|(index, setting)| {
                let part = (((index + 1) << 32) | realisation) as u64;
                let mut rng = stream(config.seed, part);
                (index, setting.trace(patch, config.rays, &mut rng))
            })
            .collect();
        for (index, batch) in here {
            batches[index].push(batch);
        }
    })?;
    Ok(SETTINGS
        .iter()
        .zip(&batches)
        .map(|(setting, batches)| setting.case(batches, config.rays))
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The check can fail: rays at another slant than the model is asked for.
    #[test]
    fn a_wrong_prediction_departs_too_far() {
        let config = Config::quick();
        let right = &SETTINGS[2];
        let wrong = Setting {
            travel_z: -0.6,
            ..*right
        };
        let mut batches = Vec::new();
        config
            .over_patches(&[[ALPHA; 2]], |realisation, _, patch| {
                let mut rng = stream(5, realisation as u64);
                batches.push(right.trace(patch, config.rays, &mut rng));
            })
            .expect("a surface");
        assert!(right.case(&batches, config.rays).heights.holds(1e-4));
        assert!(!wrong.case(&batches, config.rays).heights.holds(1e-4));
    }

    #[test]
    fn predicted_distributions_are_closed_where_they_should_be() {
        let [normal, tilted, down, up] = [0, 2, 5, 7].map(|i| &SETTINGS[i]);
        for h in [-1.5, -0.3, 0.4, 2.0] {
            let c: f64 = Gaussian.below(h);
            assert!((normal.below(h) - c).abs() < 1e-12);
            assert!(tilted.below(h) < c, "tilted shows the high ones");
        }
        assert_eq!((down.below(0.0), up.below(0.0)), (1.0, 0.0));
        assert!((up.below(9.0) - 1.0).abs() < 1e-12);
        // A ray and its reverse see the same surface: 1 + Λ down is Λ up.
        let (r_down, r_up) = (down.rate_and_start().0, up.rate_and_start().0);
        assert!((r_down - r_up - 1.0).abs() < 1e-12);
    }
}
