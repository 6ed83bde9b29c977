//! The renderer and the command from outside, in one program: linking Embree
//! once takes less time than once for each file.

mod absorption;
mod bad_input;
mod blender;
mod camera;
mod cli;
mod common;
mod converge;
mod cycles;
mod denoise;
mod description;
mod description_files;
mod diff;
mod endurance;
mod explicit_stack;
mod extreme_scenes;
mod extremes;
mod film_files;
mod films;
mod frames;
mod heightfield;
mod inputs;
mod layers;
mod leadr;
mod light;
mod merge;
mod parity;
mod relief;
mod render;
mod shading_normals;
mod tables;
mod textures;
mod validate;
mod visibility;
