//! (see the crate's front page)

pub mod heightfield;
