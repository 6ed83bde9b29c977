//! Albedos that Blender's Cycles measured (`tests/data`, written by
//! `blender/measure_albedo.py`), and the means to measure the model's as well.

use std::path::Path;

use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use smithwalk_model::*;

/// Reflectance of gold facets: red is a white furnace.
pub const GOLD: [f64; 3] = [1.0, 0.71, 0.29];

/// A row of `cycles_*_albedo_conductor.csv`.
#[derive(Deserialize)]
pub struct Metal {
    pub distribution: String,
    /// √α.
    pub roughness: f64,
    pub anisotropy: f64,
    /// Of the tangent, in turns.
    pub rotation: f64,
    pub cos: f64,
    red: f64,
    green: f64,
    red_se: f64,
    green_se: f64,
}

/// A row of `cycles_*_albedo_dielectric.csv`.
#[derive(Deserialize)]
pub struct Glass {
    pub distribution: String,
    /// √α.
    pub roughness: f64,
    ior: f64,
    /// `outside` or `inside`.
    pub side: String,
    pub cos: f64,
    r: f64,
    t: f64,
    r_se: f64,
    t_se: f64,
}

impl Metal {
    /// The albedo in the red channel and in the green one.
    pub fn measured(&self) -> [Mean; 2] {
        [(self.red, self.red_se), (self.green, self.green_se)].map(Mean::rounded)
    }

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
}

impl Glass {
    /// Reflectance and transmittance.
    pub fn measured(&self) -> [Mean; 2] {
        [(self.r, self.r_se), (self.t, self.t_se)].map(Mean::rounded)
    }

    /// n(far side) / n(near side).
    pub fn eta(&self) -> f64 {
        match self.side.as_str() {
            "outside" => self.ior,
            "inside" => self.ior.recip(),
            side => panic!("no side: {side}"),
        }
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
    /// A value of Cycles with its standard error, as the file has them.
    fn rounded((value, error): (f64, f64)) -> Self {
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
