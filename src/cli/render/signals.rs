//! Signals: SIGINT, SIGTERM and SIGHUP end a render, SIGUSR1 saves it.

use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use anyhow::Context;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGUSR1, SIGXFSZ};
use signal_hook::flag;

/// What has been asked for by signals.
pub struct Signals {
    interrupt: Arc<AtomicBool>,
    save: Arc<AtomicBool>,
    /// The signal that ended the render; 0 without one.
    number: Arc<AtomicUsize>,
}

impl Signals {
    /// Listens from now on.
    pub fn listen() -> anyhow::Result<Self> {
        let signals = Self {
            interrupt: Arc::new(AtomicBool::new(false)),
            save: Arc::new(AtomicBool::new(false)),
            number: Arc::new(AtomicUsize::new(0)),
        };
        signals.register().context("can't listen for signals")?;
        Ok(signals)
    }

    fn register(&self) -> std::io::Result<()> {
        // A second Ctrl-C is from somebody who does not want to wait.
        flag::register_conditional_shutdown(SIGINT, 128 + SIGINT, Arc::clone(&self.interrupt))?;
        for signal in [SIGINT, SIGTERM, SIGHUP] {
            flag::register_usize(signal, Arc::clone(&self.number), signal as usize)?;
            flag::register(signal, Arc::clone(&self.interrupt))?;
        }
        flag::register(SIGUSR1, Arc::clone(&self.save))?;
        // Whoever is listened for does not end the program: a file beyond the limit of
        // sizes is then refused like one on a full disk.
        flag::register(SIGXFSZ, Arc::default())?;
        Ok(())
    }

    /// Whether the render is to end.
    pub fn interrupt(&self) -> &AtomicBool {
        &self.interrupt
    }

    /// Whether it is to be saved now.
    pub fn save(&self) -> &AtomicBool {
        &self.save
    }

    /// 128 and the number of the signal, as shells count, so that a queue does not take
    /// an interrupted render for a complete one; else success.
    pub fn exit_code(&self) -> ExitCode {
        match self.number.load(Ordering::Relaxed) {
            0 => ExitCode::SUCCESS,
            signal => u8::try_from(128 + signal).map_or(ExitCode::FAILURE, ExitCode::from),
        }
    }
}
