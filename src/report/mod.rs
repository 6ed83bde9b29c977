//! Reports: the model's statements with figures, and the surface it stands for.

pub mod converge;
pub mod heightfield;
pub mod plot;
pub mod validate;
