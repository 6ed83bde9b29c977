//! Albedos that Blender's Cycles measured (`tests/data`, written by
//! `blender/measure_albedo.py`), and the means to measure the model's as well.
#![allow(dead_code)] // each user takes its part

use std::path::Path;

use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use smithwalk::microsurface::*;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Reflectance of gold facets: red is a white furnace.
pub const GOLD: [f64; 3] = [1.0, 0.71, 0.29];

/// A row of `cycles_*_albedo_conductor.csv`.
#[derive(Clone, Debug, Deserialize)]
pub struct Metal {
    pub distribution: String,
    /// √α.
    pub roughness: f64,
    pub anisotropy: f64,
    /// Of the tangent, in turns.
    pub rotation: f64,
    pub cos: f64,
    pub red: f64,
    pub green: f64,
    pub blue: f64,
    pub red_se: f64,
    pub green_se: f64,
    pub blue_se: f64,
}

/// A row of `cycles_*_albedo_dielectric.csv`.
#[derive(Clone, Debug, Deserialize)]
pub struct Glass {
    pub distribution: String,
    /// √α.
    pub roughness: f64,
    pub ior: f64,
    /// `outside` or `inside`.
    pub side: String,
    pub cos: f64,
    pub r: f64,
    pub t: f64,
    pub r_se: f64,
    pub t_se: f64,
}

impl Metal {
    /// α along x and y, as the Anisotropic node takes them.
    pub fn alpha(&self) -> (f64, f64) {
        let (alpha, a) = (self.roughness * self.roughness, self.anisotropy);
        let (x, y) = if a < 0.0 {
            (alpha / (1.0 + a), alpha * (1.0 + a))
        } else {
            (alpha * (1.0 - a), alpha / (1.0 - a))
        };
        (x.min(1.0), y.min(1.0))
    }

    /// The view in the frame of the tangent: (0, −sinθ, cosθ) in that of the
    /// sheet, whose x axis is turned by the rotation to be the tangent.
    pub fn view(&self) -> Vector3<f64> {
        Vector3::spherical(self.cos, -std::f64::consts::TAU * (0.25 + self.rotation))
    }

    /// What the row is, for messages.
    pub fn name(&self) -> String {
        let Self {
            distribution,
            roughness,
            anisotropy,
            rotation,
            cos,
            ..
        } = self;
        format!("{distribution} r {roughness} a {anisotropy} turned {rotation} cosθ {cos}")
    }
}

impl Glass {
    /// n(far side) / n(near side).
    pub fn eta(&self) -> f64 {
        match self.side.as_str() {
            "outside" => self.ior,
            "inside" => self.ior.recip(),
            side => panic!("no side: {side}"),
        }
    }

    /// What the row is, for messages.
    pub fn name(&self) -> String {
        let Self {
            distribution,
            roughness,
            side,
            cos,
            ..
        } = self;
        format!("{distribution} r {roughness} {side} cosθ {cos}")
    }
}

/// The rows of a file of `tests/data`.
pub fn rows<R: DeserializeOwned>(file: &str) -> Vec<R> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    let path = path.join(file);
    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .from_path(&path)
        .unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let rows = reader.deserialize();
    rows.map(|row| row.unwrap_or_else(|e| panic!("{}: {e}", path.display())))
        .collect()
}

/// A mean with its standard error.
#[derive(Clone, Copy, Debug)]
pub struct Mean {
    pub value: f64,
    pub error: f64,
}

/// Half a unit of the sixth digit, evenly distributed: what Cycles' values
/// were rounded by.
const ROUNDING: f64 = 2.9e-7;

impl Mean {
    /// Of Cycles.
    pub fn measured(value: f64, error: f64) -> Self {
        let error = error.hypot(ROUNDING);
        Self { value, error }
    }

    /// What this is above `other`.
    pub fn above(self, other: Self) -> Self {
        Self {
            value: self.value - other.value,
            error: self.error.hypot(other.error),
        }
    }

    /// Standard scores from 0.
    pub fn score(self) -> f64 {
        self.value.abs() / self.error
    }
}

/// The chance that one test's comparisons pass their bound though nothing is
/// wrong.
const FALSE_ALARM: f64 = 1e-4;

/// The score that `count` comparisons may reach (Šidák). Errors come from the
/// scatter of 16 values on either side, so scores have Student's distribution
/// of 15 to 30 degrees; the bound is that of 15, and nowhere too tight.
pub fn worst_score(count: usize) -> f64 {
    let each = -((-FALSE_ALARM).ln_1p() / count as f64).exp_m1();
    let student = StudentsT::new(0.0, 1.0, f64::from(SETS - 1)).expect("degrees of freedom");
    -student.inverse_cdf(0.5 * each)
}

/// The comparison of many differences with 0.
#[derive(Debug)]
pub struct Summary {
    pub count: usize,
    /// The largest difference.
    pub worst: f64,
    /// The row it is in.
    pub worst_row: String,
    /// The largest score.
    pub score: f64,
    /// The mean of the squared scores: where nothing but noise is between the
    /// two 1.07 to 1.15 (Student), with a standard deviation of at most
    /// 1.84/√count. Tests ask for less than 1.5 of 330 and 660 rows, and 1.8
    /// of 60: 3.4 and 2.7 deviations, for fixed seeds and fixed tables.
    pub chi_square: f64,
    /// The largest standard error.
    pub error: f64,
}

impl Summary {
    pub fn of(differences: &[(String, Mean)]) -> Self {
        let most = |f: fn(&Mean) -> f64| differences.iter().map(|(_, d)| f(d)).fold(0.0, f64::max);
        let worst = most(|d| d.value.abs());
        let row = differences.iter().find(|(_, d)| d.value.abs() == worst);
        let squares: f64 = differences.iter().map(|(_, d)| d.score().powi(2)).sum();
        Self {
            count: differences.len(),
            worst,
            worst_row: row.map(|(name, _)| name.clone()).unwrap_or_default(),
            score: most(|d| d.score()),
            chi_square: squares / differences.len() as f64,
            error: most(|d| d.error),
        }
    }
}

/// Scrambled Sobol sets of a mean, from whose scatter its error comes: as many
/// as the pixels from whose scatter Cycles' errors come.
pub const SETS: u32 = 16;

/// The means of `N` quantities over [`SETS`] × `points` random points, by
/// randomised quasi-Monte Carlo.
pub fn means<const N: usize>(
    points: u32,
    mut sample: impl FnMut(&mut Points) -> [f64; N],
) -> [Mean; N] {
    let mut sets = Vec::new();
    for set in 0..SETS {
        let mut sum = [0.0; N];
        for index in 0..points {
            let mut rng = Points::new(set, index);
            for (sum, x) in sum.iter_mut().zip(sample(&mut rng)) {
                *sum += x / f64::from(points);
            }
        }
        sets.push(sum);
    }
    let count = f64::from(SETS);
    std::array::from_fn(|i| {
        let value = sets.iter().map(|s| s[i]).sum::<f64>() / count;
        let squares: f64 = sets.iter().map(|s| (s[i] - value).powi(2)).sum();
        Mean {
            value,
            error: (squares / (count - 1.0) / count).sqrt(),
        }
    })
}

/// Dimensions that are stratified; the rest of a walk is independent.
const STRATIFIED: u32 = 24;

/// One point of an Owen-scrambled Sobol set.
#[derive(Clone)]
pub struct Points {
    set: u32,
    index: u32,
    dimension: u32,
    four: [f32; 4],
    rest: Pcg64Mcg,
}

impl Points {
    fn new(set: u32, index: u32) -> Self {
        Self {
            set,
            index,
            dimension: 0,
            four: [0.0; 4],
            rest: Pcg64Mcg::seed_from_u64(u64::from(set) << 32 | u64::from(index)),
        }
    }
}

impl Draw<f64> for Points {
    fn draw(&mut self) -> f64 {
        let dimension = self.dimension;
        if dimension >= STRATIFIED {
            return Stream(&mut self.rest).draw();
        }
        self.dimension += 1;
        if dimension % 4 == 0 {
            self.four = sobol_burley::sample_4d(self.index, dimension / 4, self.set);
        }
        f64::from(self.four[dimension as usize % 4])
    }
}
