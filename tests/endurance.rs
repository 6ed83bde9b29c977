//! Renders that are killed, ended, and refused by the disk: nothing is lost that need
//! not be.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;
use smithwalk::film::SavedFilm;

use crate::films::Room;

/// An image that takes a while.
const SIZE: [&str; 4] = ["-D", "film.width=20", "-D", "film.height=14"];

fn send(signal: &str, child: &Child) {
    let id = child.id().to_string();
    let sent = Command::new("kill").args([signal, &id]).status().unwrap();
    assert!(sent.success());
}

/// Starts a render; gives its lines on standard error when it is over.
fn start(room: &Room, more: &[&str]) -> (Child, std::thread::JoinHandle<Vec<String>>) {
    let mut child = room.command(more);
    let child = child.stdout(Stdio::null()).stderr(Stdio::piped()).spawn();
    let mut child = child.unwrap();
    let log = BufReader::new(child.stderr.take().unwrap());
    let log = std::thread::spawn(move || log.lines().map_while(Result::ok).collect());
    (child, log)
}

fn leftovers(room: &Room) -> usize {
    let names = std::fs::read_dir(&room.0).unwrap();
    let is_left = |name: std::io::Result<std::fs::DirEntry>| {
        let name = name.unwrap().file_name();
        name.to_string_lossy().ends_with(".part")
    };
    names.map(is_left).filter(|&left| left).count()
}

/// What kills at evenly spread moments did.
#[derive(Debug, Default)]
struct Killed {
    /// How many were while a checkpoint was written.
    writing: usize,
    /// How many runs had a checkpoint.
    with_checkpoint: usize,
    /// Seconds between the last checkpoint and the last word before the kill, at most.
    lost: f64,
}

/// Renders so many samples with a checkpoint every 50 ms, killed and gone on with so many times, at
/// moments from 20 ms to `latest` ms after the start; then to its end, which has the bits
/// of a render that nothing happened to.
fn killed(name: &str, kills: u32, latest: u32, spp: &str) -> Killed {
    let room = Room::new(name);
    let spp = ["--spp", spp];
    room.render(&[&["-o", "whole.exr"][..], &SIZE, &spp].concat());
    let more = ["-o", "a.exr", "--resume", "--checkpoint", "0.05"];
    let more = [&more[..], &SIZE, &spp].concat();
    let mut found = Killed::default();
    for kill in 0..kills {
        let told = [&more[..], &["--progress", "json"]].concat();
        let (mut child, log) = start(&room, &told);
        // In an order that visits early and late moments in turn.
        let moment = 20 + (kill * 37 % kills) * (latest - 20) / kills;
        std::thread::sleep(Duration::from_millis(moment.into()));
        send("-9", &child);
        child.wait().unwrap();
        found.writing += leftovers(&room);
        let log = log.join().unwrap();
        let last = log
            .iter()
            .rev()
            .find_map(|l| serde_json::from_str::<Value>(l).ok());
        let last = last.unwrap_or_default();
        if let (Some(elapsed), Some(saved)) =
            (last["elapsed"].as_f64(), last["checkpoint"].as_f64())
        {
            found.with_checkpoint += 1;
            found.lost = found.lost.max(elapsed - saved);
        }
    }
    room.render(&more);
    assert_eq!(room.image("a.exr").color, room.image("whole.exr").color);
    assert_eq!(leftovers(&room), 0);
    found
}

#[test]
fn kills_at_any_moment_change_no_bit() {
    killed("kills", 8, 500, "256");
}

/// With some of the kills within the writing of a checkpoint.
/// `cargo test --release --test suite -- --ignored --nocapture a_hundred_kills`
#[test]
#[ignore = "two minutes"]
fn a_hundred_kills_change_no_bit() {
    let found = killed("hundred", 100, 1500, "8192");
    println!("{found:?}");
    assert!(found.writing > 0, "{found:?}");
    // An interval, and the second of a loaded machine.
    assert!(found.with_checkpoint > 20 && found.lost < 1.05, "{found:?}");
}

/// SIGTERM again and again: each time the film has every sample that was told of, and
/// the end has the bits of a render that nothing happened to.
fn ended(name: &str, times: u32) {
    let room = Room::new(name);
    let more = [
        "-o",
        "a.exr",
        "--resume",
        "--checkpoint",
        "0",
        "--progress",
        "json",
    ];
    let more = [&more[..], &SIZE].concat();
    let endless = [&more[..], &["--spp", "1000000"]].concat();
    let mut most = 0;
    let mut saved = 0;
    for time in 0..times {
        let (mut child, log) = start(&room, &endless);
        std::thread::sleep(Duration::from_millis(u64::from(150 + 37 * (time % 10))));
        send("-TERM", &child);
        let begun = Instant::now();
        let code = child.wait().unwrap().code();
        let log = log.join().unwrap();
        // Where it had not begun, the signal had its own way.
        let Some(code) = code else { continue };
        assert_eq!(code, 143);
        assert!(begun.elapsed() < Duration::from_secs(30));
        let last = log
            .iter()
            .rev()
            .find_map(|l| serde_json::from_str::<Value>(l).ok());
        let told = last.expect("there is progress")["spp"].as_f64().unwrap();
        let film = SavedFilm::read(Path::new(&room.file("a.exr.film")))
            .unwrap()
            .film;
        let pixels: usize = film.tiles().iter().map(|t| t.window().area()).sum();
        let samples = film.tiles().iter();
        let samples: f64 = samples
            .map(|t| t.window().area() as f64 * f64::from(t.taken().count()))
            .sum();
        let there = samples / pixels as f64;
        assert!((there - told).abs() < 1e-3, "{there} of {told}");
        most = film
            .tiles()
            .iter()
            .map(|t| t.taken().count())
            .max()
            .unwrap();
        saved += 1;
    }
    println!("{saved} of {times} ended within a render");
    assert!(saved > 0);
    let spp = most.to_string();
    room.render(&[&more[..], &["--spp", &spp]].concat());
    room.render(&[&["-o", "whole.exr", "--spp", &spp][..], &SIZE].concat());
    assert_eq!(room.image("a.exr").color, room.image("whole.exr").color);
}

#[test]
fn what_is_ended_has_all_its_samples() {
    ended("ended", 3);
}

/// `cargo test --release --test suite -- --ignored --nocapture a_hundred_ends`
#[test]
#[ignore = "a minute"]
fn a_hundred_ends_lose_nothing() {
    ended("ends", 100);
}

/// Films that don't fit on the disk, here beyond the limit of a file's size: told, the
/// render goes on, and the image is written, which is smaller.
#[cfg(unix)]
#[test]
fn a_full_disk_is_told_and_the_render_goes_on() {
    let room = Room::new("full");
    let render = |more: &str| {
        let program = env!("CARGO_BIN_EXE_smithwalk");
        // In blocks of 512 bytes.
        let script = format!(
            "ulimit -f 16 && exec {program} render scene.yaml --spp 64 {} {more}",
            SIZE.join(" ")
        );
        let mut shell = Command::new("sh");
        shell.args(["-c", &script]).current_dir(&room.0);
        shell.output().unwrap()
    };
    let output = render("-o a.exr --checkpoint 0.02");
    let log = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{log}");
    assert!(log.contains("it is tried again later"), "{log}");
    assert_eq!(leftovers(&room), 0);
    room.render(&[&["-o", "whole.exr", "--spp", "64"][..], &SIZE].concat());
    assert_eq!(room.image("a.exr").color, room.image("whole.exr").color);
    // A film that was asked for and can't be written is a failure, and the image is there.
    let output = render("-o b.exr --resume --checkpoint 0");
    let log = String::from_utf8_lossy(&output.stderr);
    assert!(
        !output.status.success() && log.contains("b.exr.film"),
        "{log}"
    );
    assert!(Path::new(&room.file("b.exr")).exists());
}

/// A folder that goes away and can't be made again, and then can: each checkpoint says
/// so, the render goes on, and its files are there in the end.
#[test]
fn a_folder_that_goes_away_is_told_and_comes_back() {
    let room = Room::new("folder");
    let more = [
        "-o",
        "sub/a.exr",
        "--checkpoint",
        "0.05",
        "--spp",
        "1000000",
    ];
    let (mut child, log) = start(&room, &[&more[..], &SIZE].concat());
    let film = room.file("sub/a.exr.film");
    let waited = Instant::now();
    while !Path::new(&film).exists() {
        assert!(waited.elapsed() < Duration::from_secs(60), "no checkpoint");
        std::thread::sleep(Duration::from_millis(20));
    }
    // A checkpoint may be made while the folder is removed.
    while std::fs::remove_dir_all(room.0.join("sub")).is_err() {}
    while std::fs::write(room.0.join("sub"), "in the way").is_err() {
        let _ = std::fs::remove_dir_all(room.0.join("sub"));
    }
    std::thread::sleep(Duration::from_millis(500));
    assert!(child.try_wait().unwrap().is_none(), "it goes on");
    std::fs::remove_file(room.0.join("sub")).unwrap();
    let waited = Instant::now();
    while !Path::new(&film).exists() {
        assert!(
            waited.elapsed() < Duration::from_secs(60),
            "no checkpoint again"
        );
        std::thread::sleep(Duration::from_millis(20));
    }
    send("-TERM", &child);
    assert_eq!(child.wait().unwrap().code(), Some(143));
    let log = log.join().unwrap().concat();
    assert!(log.contains("it is tried again later"), "{log}");
    assert!(Path::new(&room.file("sub/a.exr")).exists());
}
