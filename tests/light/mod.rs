//! Lights against closed forms, and their densities against their samples.

mod common;
mod density;
mod environment;
mod extremes;
mod irradiance;
mod many;
mod units;
