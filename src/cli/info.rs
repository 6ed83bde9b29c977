//! `smithwalk info`.

use std::io::Write;
use std::process::ExitCode;

use serde_json::json;
use smithwalk::features::Features;
use smithwalk::integrator::{KERNELS, kernel_for};
use smithwalk::memory::{Bytes, resident};
use smithwalk::scene::{RenderSettings, Scene};

use super::scene::{SceneArgs, display};

#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    scene: SceneArgs,
    /// For scripts
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args, out: &mut dyn Write, log: &mut dyn Write) -> anyhow::Result<ExitCode> {
    let description = args.scene.describe()?;
    display(&description)?;
    let start = std::time::Instant::now();
    let scene = args.scene.resolve(&description, log)?.scene;
    let seconds = start.elapsed().as_secs_f64();
    let film_bytes = RenderSettings::new(&description).memory();
    let needed = needed(film_bytes);
    let kernel = KERNELS[kernel_for(scene.features)];
    if args.json {
        let features: Vec<_> = Features::ALL
            .iter()
            .map(|(feature, name, cost)| {
                json!({
                    "name": name,
                    "used": scene.features.contains(*feature),
                    "in_kernel": kernel.contains(*feature),
                    "cost": cost,
                })
            })
            .collect();
        let report = json!({
            "scene": args.scene.scene,
            "objects": scene.objects.len(),
            "meshes": scene.meshes.len(),
            "triangles": scene.triangles(),
            "materials": scene.materials.len(),
            "textures": scene.textures.len(),
            "lights": scene.lights.lamps().len(),
            "bytes": bytes(&scene, film_bytes).map(|(name, bytes)| json!({"what": name, "bytes": bytes})),
            "memory": needed,
            "start_up_seconds": seconds,
            "features": features,
        });
        writeln!(out, "{}", serde_json::to_string_pretty(&report)?)?;
        return Ok(ExitCode::SUCCESS);
    }
    writeln!(
        out,
        "{} objects of {} meshes with {} triangles, {} materials, {} textures, {} lights",
        scene.objects.len(),
        scene.meshes.len(),
        scene.triangles(),
        scene.materials.len(),
        scene.textures.len(),
        scene.lights.lamps().len(),
    )?;
    let film = &description.film;
    writeln!(
        out,
        "{} × {} pixels, {} spp, {} bounces; read and built in {seconds:.3} s",
        film.width, film.height, description.sampling.spp, description.sampling.max_bounces
    )?;
    for (what, bytes) in bytes(&scene, film_bytes) {
        writeln!(out, "  {what:<24} {:>10.1} kB", bytes as f64 / 1e3)?;
    }
    if let Some(needed) = needed {
        writeln!(out, "a render takes {} of memory", Bytes(needed))?;
    }
    writeln!(out, "in use:")?;
    for (feature, name, cost) in Features::ALL {
        if scene.features.contains(*feature) {
            writeln!(out, "  {name}: {cost}")?;
        }
    }
    writeln!(out, "not in use, but in the kernel that fits best:")?;
    for (feature, name, _) in Features::ALL {
        if kernel.contains(*feature) && !scene.features.contains(*feature) {
            writeln!(out, "  {name}")?;
        }
    }
    writeln!(out, "left out:")?;
    for (feature, name, cost) in Features::ALL {
        if !kernel.contains(*feature) {
            writeln!(out, "  {name}: saves {cost}")?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// The most that a render holds at once: what this process did, or what it holds
/// now and the film.
fn needed(film: u64) -> Option<u64> {
    /// Threads, kernels and encoders of a render, measured on two cores.
    const RENDER: u64 = 2_500_000;
    let [now, most] = resident()?;
    Some(most.max(now + film + RENDER))
}

/// What takes memory; the program itself and what it holds of the scene file aside.
fn bytes(scene: &Scene, film: u64) -> [(&'static str, usize); 7] {
    let meshes = &scene.meshes;
    let sum = |size: fn(&smithwalk::scene::SceneMesh) -> usize| meshes.iter().map(size).sum();
    [
        (
            "positions and triangles",
            sum(|m| size_of_val(&**m.vertices) + size_of_val(&**m.triangles)),
        ),
        (
            "normals",
            sum(|m| m.normals.as_deref().map_or(0, size_of_val)),
        ),
        (
            "texture coordinates",
            sum(|m| m.uvs.as_deref().map_or(0, size_of_val)),
        ),
        (
            "textures",
            smithwalk::texture::Texture::memory(&scene.textures),
        ),
        ("lights", scene.lights.bytes()),
        ("Embree", scene.accelerator.memory() as usize),
        ("film", film as usize),
    ]
}
