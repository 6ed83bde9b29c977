//! Frames of an animation, one after another, without building again what stands still.

use std::collections::BTreeSet;
use std::io::Write;
use std::process::ExitCode;
use std::sync::atomic::Ordering;

use anyhow::ensure;
use smithwalk::description::{Animation, Frame};
use smithwalk::scene::{RenderSettings, Stage};

use super::super::scene::display;
use super::outputs::Outputs;
use super::signals::Signals;
use super::{Args, FrameRange, Shot, apply, complete_mark, override_settings, start_threads};

pub fn run(
    args: &Args,
    range: &FrameRange,
    out: &mut dyn Write,
    log: &mut dyn Write,
) -> anyhow::Result<ExitCode> {
    let animation = Animation::load(&args.scene.scene, &args.scene.overrides)?;
    let describe = |number: i32| -> anyhow::Result<Frame> {
        let mut frame = animation.frame(number)?;
        apply(args, &mut frame.description);
        Ok(frame)
    };
    // What is wrong with the last one is not for the next morning.
    for number in range.clone() {
        let frame = describe(number)?;
        Outputs::new(args, Some(number))?;
        check_meshes(&frame, number)?;
        display(&frame.description)?;
    }
    start_threads(args)?;
    let mut stage = Stage::new(animation.camera());
    let mut signals: Option<Signals> = None;
    // Nobody has to read what is printed: the frames are rendered all the same.
    let mut printed: anyhow::Result<()> = Ok(());
    for number in range.clone() {
        let frame = describe(number)?;
        let description = &frame.description;
        let settings = override_settings(args, RenderSettings::new(description))?;
        let outputs = Outputs::new(args, Some(number))?;
        let film = settings.memory() + outputs.resumed_bytes(args);
        let resolved = args.scene.resolve_frame(&frame, &mut stage, film, log)?;
        let signals = match &mut signals {
            Some(signals) => signals,
            none => none.insert(Signals::listen()?),
        };
        if signals.interrupt().load(Ordering::Relaxed) {
            break;
        }
        let display = display(description)?;
        let mark = complete_mark(&resolved.identity, description, &settings, &display);
        if args.resume && outputs.are_complete(&mark) {
            printed = printed.and(line(out, format_args!("frame {number} is complete")));
        } else {
            printed = printed.and(line(out, format_args!("frame {number}")));
            let shot = Shot {
                args,
                description,
                outputs: &outputs,
                signals,
                display: &display,
                frame: Some(number),
            };
            let done = shot.take(&resolved, log)?;
            let told = shot.tell(&done, &resolved.scene, out);
            printed = printed.and(told);
        }
        stage.take_back(resolved.scene);
    }
    printed?;
    Ok(signals.map_or(ExitCode::SUCCESS, |signals| signals.exit_code()))
}

fn line(out: &mut dyn Write, text: std::fmt::Arguments<'_>) -> anyhow::Result<()> {
    Ok(writeln!(out, "{text}")?)
}

/// That there are the files of all meshes that objects have.
fn check_meshes(frame: &Frame, number: i32) -> anyhow::Result<()> {
    let description = &frame.description;
    let used: BTreeSet<&str> = description
        .objects
        .iter()
        .map(|o| o.mesh.as_str())
        .collect();
    for (name, mesh) in &description.meshes {
        let path = description.resolve_path(&mesh.file);
        ensure!(
            !used.contains(name.as_str()) || path.exists(),
            "frame {number}: the mesh `{name}` has no file {}",
            path.display()
        );
    }
    Ok(())
}
