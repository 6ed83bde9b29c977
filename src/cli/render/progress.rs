//! Progress on standard error: a bar for people, lines of JSON for programs.

use std::io::{IsTerminal, Write};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde_json::json;
use smithwalk::integrator::Progress;
use smithwalk::scene::Limits;

/// How progress is told.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum ProgressKind {
    /// A bar, if stderr is a terminal
    Bar,
    /// One JSON object a line
    Json,
}

/// Tells progress.
pub struct Reporter {
    kind: ProgressKind,
    limits: Limits,
    /// The number of the frame in an animation.
    frame: Option<i32>,
    bar: ProgressBar,
    start: Instant,
    latest: Mutex<Latest>,
}

/// What is told again until there is news.
#[derive(Default)]
struct Latest {
    noise: Option<f64>,
    /// Time of the last checkpoint since the start.
    checkpoint: Option<Duration>,
    /// Samples per pixel when progress was told first: those of a resumed film.
    begun: Option<f64>,
}

impl Reporter {
    pub fn new(kind: ProgressKind, limits: &Limits, frame: Option<i32>) -> Self {
        let bar = match limits.time {
            Some(time) => ProgressBar::new(time.as_millis() as u64),
            None => ProgressBar::new(u64::from(limits.spp)),
        };
        if kind == ProgressKind::Json || !std::io::stderr().is_terminal() {
            bar.set_draw_target(ProgressDrawTarget::hidden());
        }
        let style = ProgressStyle::with_template("{wide_bar} {percent}% {msg}, {eta} left")
            .expect("a valid template");
        Self {
            kind,
            limits: *limits,
            frame,
            bar: bar.with_style(style),
            start: Instant::now(),
            latest: Mutex::default(),
        }
    }

    /// Tells how far it is; may be called by any thread.
    pub fn show(&self, progress: Progress) {
        let frame = self.frame.map(|frame| format!("frame {frame}, "));
        let frame = frame.unwrap_or_default();
        self.bar
            .set_message(format!("{frame}{:.0} spp", progress.spp));
        self.bar.set_position(match self.limits.time {
            Some(_) => progress.elapsed.as_millis() as u64,
            None => progress.spp as u64,
        });
        if self.kind == ProgressKind::Bar {
            return;
        }
        let mut latest = self.latest.lock().expect("nobody panics with it");
        latest.noise = progress.noise.or(latest.noise);
        let begun = *latest.begun.get_or_insert(progress.spp);
        let elapsed = progress.elapsed.as_secs_f64();
        let by_samples = match progress.spp - begun {
            done if done > 0.0 => {
                Some((f64::from(progress.target) - progress.spp) * elapsed / done)
            }
            _ => None,
        };
        let by_time = self
            .limits
            .time
            .map(|time| (time.as_secs_f64() - elapsed).max(0.0));
        // Whatever is reached first counts; the noise is not foreseen.
        let eta = match (by_samples, by_time) {
            (Some(a), Some(b)) => Some(a.min(b)),
            (a, b) => a.or(b),
        };
        let rounded = |value: f64| (value * 1000.0).round() / 1000.0;
        let mut line = json!({
            "spp": rounded(progress.spp),
            "target": progress.target,
            "elapsed": rounded(elapsed),
            "eta": eta.map(rounded),
            "noise": latest.noise,
            "checkpoint": latest.checkpoint.map(|at| rounded(at.as_secs_f64())),
        });
        if let Some(frame) = self.frame {
            line["frame"] = frame.into();
        }
        // Nobody has to listen.
        let _ = writeln!(std::io::stderr(), "{line}");
    }

    /// A checkpoint is on disk.
    pub fn saved(&self) {
        let mut latest = self.latest.lock().expect("nobody panics with it");
        latest.checkpoint = Some(self.start.elapsed());
    }

    /// Tells of something that goes on all the same.
    pub fn warn(&self, message: &str) {
        self.bar.suspend(|| {
            let _ = writeln!(std::io::stderr(), "warning: {message}");
        });
    }

    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}
