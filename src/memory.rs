//! How much memory there is, and how much of it a scene may still take.

use std::fmt;
use std::sync::atomic::{AtomicU64, Ordering};

/// A number of bytes for people.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bytes(pub u64);

impl fmt::Display for Bytes {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let units = [("TB", 1e12), ("GB", 1e9), ("MB", 1e6), ("kB", 1e3)];
        match units.iter().find(|(_, size)| self.0 as f64 >= *size) {
            Some((unit, size)) => write!(f, "{:.1} {unit}", self.0 as f64 / size),
            None => write!(f, "{} bytes", self.0),
        }
    }
}

/// Something needs more memory than is left.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{what} needs {needed}, but {left} of {limit} are left; --memory sets the limit")]
pub struct OutOfMemory {
    /// What needs it.
    pub what: String,
    /// How much it needs.
    pub needed: Bytes,
    /// How much there was.
    pub left: Bytes,
    /// How much there was at the start.
    pub limit: Bytes,
}

/// The memory that a render may take. Whatever is large asks before it takes.
#[derive(Debug)]
pub struct Budget {
    limit: u64,
    taken: AtomicU64,
}

impl Budget {
    /// A budget of so many bytes.
    #[must_use]
    pub fn new(limit: u64) -> Self {
        Self {
            limit,
            taken: AtomicU64::new(0),
        }
    }

    /// What the machine has to give now; without end where it does not tell.
    #[must_use]
    pub fn of_machine() -> Self {
        Self::new(available().unwrap_or(u64::MAX))
    }

    /// How many bytes are left.
    #[must_use]
    pub fn left(&self) -> u64 {
        self.limit - self.taken.load(Ordering::Relaxed)
    }

    /// Sets bytes aside for good.
    ///
    /// # Errors
    /// When fewer are left; then nothing is set aside.
    pub fn take(&self, bytes: u64, what: impl fmt::Display) -> Result<(), OutOfMemory> {
        let enough = |taken: u64| taken.checked_add(bytes).filter(|&sum| sum <= self.limit);
        self.taken
            .fetch_update(Ordering::Relaxed, Ordering::Relaxed, enough)
            .map(|_| ())
            .map_err(|taken| OutOfMemory {
                what: what.to_string(),
                needed: Bytes(bytes),
                left: Bytes(self.limit - taken),
                limit: Bytes(self.limit),
            })
    }
}

/// The bytes that this process holds now, and the most it has held; none where the
/// system does not tell.
#[must_use]
pub fn resident() -> Option<[u64; 2]> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let bytes = |name: &str| {
        let line = status.lines().find(|line| line.starts_with(name))?;
        let kib = line.split_ascii_whitespace().nth(1)?.parse::<u64>().ok()?;
        Some(kib * 1024)
    };
    Some([bytes("VmRSS:")?, bytes("VmHWM:")?])
}

/// What the system, and the group of processes that this one belongs to, can
/// give, in bytes.
fn available() -> Option<u64> {
    let read = |path: &str| std::fs::read_to_string(path).ok();
    let meminfo = read("/proc/meminfo")?;
    let line = meminfo
        .lines()
        .find(|line| line.starts_with("MemAvailable:"))?;
    let kib: u64 = line.split_ascii_whitespace().nth(1)?.parse().ok()?;
    let number = |path: &str| read(path)?.trim().parse::<u64>().ok();
    let of_group = |most: &str, used: &str| Some(number(most)?.saturating_sub(number(used)?));
    let groups = [
        of_group("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory.current"),
        of_group(
            "/sys/fs/cgroup/memory/memory.limit_in_bytes",
            "/sys/fs/cgroup/memory/memory.usage_in_bytes",
        ),
    ];
    Some(groups.into_iter().flatten().fold(kib * 1024, u64::min))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_taken_is_gone_and_no_more_can_be_taken() {
        let budget = Budget::new(3_000_000);
        assert_eq!(budget.take(2_000_000, "a"), Ok(()));
        assert_eq!(
            budget.take(2_000_000, "the image").unwrap_err().to_string(),
            "the image needs 2.0 MB, but 1.0 MB of 3.0 MB are left; --memory sets the limit"
        );
        assert_eq!(
            budget.take(u64::MAX, "b").unwrap_err().left,
            Bytes(1_000_000)
        );
        assert_eq!(budget.take(1_000_000, "c"), Ok(()));
        assert!(Budget::of_machine().left() > 1_000_000);
    }
}
