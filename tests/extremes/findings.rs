//! What a run of the suite found.

use std::fmt;

/// What can be wrong with a call.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A value that is infinite, not a number, or negative.
    Value,
    /// A direction that is not of unit length, or level.
    Direction,
    /// A weight above 1, or a lossless surface that loses light.
    Energy,
    /// A density that is zero or infinite where light goes.
    Density,
    /// A walk that does not end in time.
    Steps,
    /// A value that jumps.
    Jump,
}

impl Kind {
    const ALL: [Self; 6] = [
        Self::Value,
        Self::Direction,
        Self::Energy,
        Self::Density,
        Self::Steps,
        Self::Jump,
    ];
}

/// How many faults are told in words, per kind.
const TOLD: usize = 3;

/// Calls, the longest of them, and what was wrong.
#[derive(Clone, Debug, Default)]
pub struct Findings {
    /// Calls of `sample`, `eval`, `pdf` and their like.
    pub calls: u64,
    /// The most random numbers that a call drew, on surfaces of α ≤ 1 and on
    /// all.
    pub most_draws: [usize; 2],
    counts: [u64; 6],
    told: Vec<(Kind, String)>,
}

impl Findings {
    /// Counts a fault if `fine` is false.
    pub fn expect(&mut self, fine: bool, kind: Kind, what: impl FnOnce() -> String) {
        if fine {
            return;
        }
        self.counts[kind as usize] += 1;
        if self.told.iter().filter(|(k, _)| *k == kind).count() < TOLD {
            self.told.push((kind, what()));
        }
    }

    /// How many faults of this kind there are.
    pub fn count(&self, kind: Kind) -> u64 {
        self.counts[kind as usize]
    }

    /// How many faults there are.
    pub fn faults(&self) -> u64 {
        self.counts.iter().sum()
    }

    /// Both together.
    pub fn merged(mut self, other: Self) -> Self {
        self.calls += other.calls;
        for (most, of_other) in self.most_draws.iter_mut().zip(other.most_draws) {
            *most = of_other.max(*most);
        }
        for (count, of_other) in self.counts.iter_mut().zip(other.counts) {
            *count += of_other;
        }
        for (kind, what) in other.told {
            if self.told.iter().filter(|(k, _)| *k == kind).count() < TOLD {
                self.told.push((kind, what));
            }
        }
        self
    }

    /// # Panics
    /// If anything was found.
    pub fn assert_clean(&self) {
        println!("{self}");
        assert!(self.faults() == 0, "{self}");
    }
}

impl fmt::Display for Findings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} calls, at most {} draws in one (α ≤ 1: {}), {} faults",
            self.calls,
            self.most_draws[1],
            self.most_draws[0],
            self.faults()
        )?;
        for kind in Kind::ALL {
            if self.count(kind) > 0 {
                write!(f, "\n{kind:?}: {}", self.count(kind))?;
            }
        }
        for (kind, what) in &self.told {
            write!(f, "\n- {kind:?}: {what}")?;
        }
        Ok(())
    }
}
