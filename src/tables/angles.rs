//! f over (θ_i, θ_o, φ).

use std::f64::consts::{FRAC_PI_2, PI};

use rayon::prelude::*;

use super::estimate::{Estimate, Source, spherical};
use super::npz::Npz;
use crate::image::{Image, Layer, Window};

/// How many angles a table has of each kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Angles {
    /// Polar angles of ω_i, in the middle of equal parts of 0 … 90°.
    pub theta_i: usize,
    /// Polar angles of ω_o, in the middle of equal parts of 0 … 90°; where light
    /// goes through, as many again below, to 180°.
    pub theta_o: usize,
    /// Azimuths from ω_i to ω_o, from 0 to 180°, both included (≥ 2).
    pub phi: usize,
}

/// f(ω_i, ω_o) of an isotropic material, sr⁻¹, without a cosine, with standard
/// errors. ω_i is above; both point away from the surface.
#[derive(Clone, Debug)]
pub struct AngleTable {
    /// Radians.
    pub theta_i: Vec<f64>,
    /// Radians.
    pub theta_o: Vec<f64>,
    /// Radians.
    pub phi: Vec<f64>,
    /// `[θ_i][θ_o][φ]`, φ running fastest.
    pub values: Vec<Estimate>,
}

impl AngleTable {
    /// Measures it.
    #[must_use]
    pub fn measure(source: &Source<'_>, angles: Angles) -> Self {
        let middles = |n: usize, count: usize| -> Vec<f64> {
            let step = FRAC_PI_2 / n as f64;
            (0..count).map(|i| (i as f64 + 0.5) * step).collect()
        };
        let theta_i = middles(angles.theta_i, angles.theta_i);
        let sides = if source.transmits() { 2 } else { 1 };
        let theta_o = middles(angles.theta_o, sides * angles.theta_o);
        let last = (angles.phi.max(2) - 1) as f64;
        let phi: Vec<f64> = (0..angles.phi.max(2))
            .map(|i| PI * i as f64 / last)
            .collect();
        let count = theta_i.len() * theta_o.len() * phi.len();
        let value = |index: usize| {
            let (row, azimuth) = (index / phi.len(), phi[index % phi.len()]);
            let wi = spherical(theta_i[row / theta_o.len()], 0.0);
            let wo = spherical(theta_o[row % theta_o.len()], azimuth);
            // The walk begins at ω_i; the cosine is that of the other.
            let found = source.scattered(wi, wo, 0, index as u64);
            let cos = f64::from(wo.z.abs());
            Estimate {
                value: found.value.map(|x| x / cos),
                error: found.error.map(|x| x / cos),
            }
        };
        let values = (0..count).into_par_iter().map(value).collect();
        Self {
            theta_i,
            theta_o,
            phi,
            values,
        }
    }

    /// Root mean square of the standard errors over that of the values.
    #[must_use]
    pub fn relative_error(&self) -> f64 {
        let squares = |of: fn(&Estimate) -> [f64; 3]| -> f64 {
            self.values.iter().flat_map(of).map(|x| x * x).sum()
        };
        (squares(|e| e.error) / squares(|e| e.value)).sqrt()
    }

    /// As a numpy archive: `theta_i`, `theta_o`, `phi` (radians), `f` and
    /// `f_stderr` (θ_i, θ_o, φ, channels), float64, and texts of these names.
    ///
    /// # Errors
    /// When the archive refuses, which it has no reason to.
    pub fn npz(&self, texts: &[(&str, String)]) -> Result<Vec<u8>, zip::result::ZipError> {
        let mut file = Npz::new();
        for (name, angles) in [
            ("theta_i", &self.theta_i),
            ("theta_o", &self.theta_o),
            ("phi", &self.phi),
        ] {
            file.numbers(name, &[angles.len()], angles.iter().copied())?;
        }
        let shape = [self.theta_i.len(), self.theta_o.len(), self.phi.len(), 3];
        file.numbers("f", &shape, self.values.iter().flat_map(|e| e.value))?;
        file.numbers("f_stderr", &shape, self.values.iter().flat_map(|e| e.error))?;
        for (name, text) in texts {
            file.text(name, text)?;
        }
        file.finish()
    }

    /// As an image: φ goes to the right, θ_o and, slower, θ_i downwards; `stderr`
    /// and the angles in radians are layers.
    #[must_use]
    pub fn image(&self, texts: &[(&str, String)]) -> Image {
        let size = [self.phi.len(), self.values.len() / self.phi.len()].map(|n| n as u32);
        let mut image = Image::black(size, Window::full(size));
        image.color = self
            .values
            .iter()
            .map(|e| e.value.map(|x| x as f32))
            .collect();
        let mut layer = |name: &str, planes: &[(&str, Vec<f32>)]| {
            image.layers.push(Layer {
                name: name.to_owned(),
                channels: planes.iter().map(|(name, _)| (*name).to_owned()).collect(),
                planes: planes.iter().map(|(_, plane)| plane.clone()).collect(),
            });
        };
        let error = |c: usize| self.values.iter().map(|e| e.error[c] as f32).collect();
        layer(
            "stderr",
            &[("R", error(0)), ("G", error(1)), ("B", error(2))],
        );
        let angle = |of: &dyn Fn(usize) -> f64| {
            (0..self.values.len())
                .map(|i| of(i) as f32)
                .collect::<Vec<_>>()
        };
        let (columns, rows) = (self.phi.len(), self.theta_o.len());
        let theta_i = angle(&|i| self.theta_i[i / columns / rows]);
        let theta_o = angle(&|i| self.theta_o[i / columns % rows]);
        let phi = angle(&|i| self.phi[i % columns]);
        layer(
            "angle",
            &[("theta_i", theta_i), ("theta_o", theta_o), ("phi", phi)],
        );
        image.attributes = texts
            .iter()
            .map(|(name, text)| ((*name).to_owned(), text.clone()))
            .collect();
        image
    }
}
