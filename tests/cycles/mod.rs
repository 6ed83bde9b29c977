//! Directional albedos of the model against those that Blender's Cycles
//! measured.

mod glass;
mod judged;
mod measured;
mod metal;
mod shortcuts;
