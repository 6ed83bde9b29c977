//! Files for what reads from paths.

use std::path::PathBuf;

/// A file in memory that holds these bytes; each process has its own.
pub fn written(name: &str, bytes: &[u8]) -> PathBuf {
    let path = PathBuf::from(format!("/dev/shm/smithwalk-fuzz-{}-{name}", std::process::id()));
    std::fs::write(&path, bytes).expect("there is room in /dev/shm");
    path
}
