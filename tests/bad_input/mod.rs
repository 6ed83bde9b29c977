//! What people are told about scenes, meshes and images that can't be used.

mod images;
mod meshes;
mod scenes;

use std::path::PathBuf;

/// A directory that is empty at the start.
fn directory(name: &str) -> PathBuf {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&path);
    std::fs::create_dir_all(&path).unwrap();
    path
}

/// Machine paths have no place in snapshots.
fn without(text: &str, directory: &std::path::Path) -> String {
    text.replace(&directory.display().to_string(), "DIR")
}
