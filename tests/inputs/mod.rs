//! Files as other programs write them, one table for each kind of file: read
//! right, or refused by name.

mod command;
mod files;
// Tables with a case on each line.
#[rustfmt::skip]
mod images;
#[rustfmt::skip]
mod meshes;
#[rustfmt::skip]
mod scenes;

/// Fails with all that is wrong at once.
fn assert_none(faults: &[String]) {
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// A folder of its own for a test, empty at the start.
fn directory(name: &str) -> std::path::PathBuf {
    let path = std::path::PathBuf::from(env!("CARGO_TARGET_TMPDIR"))
        .join("inputs")
        .join(name);
    let _ = std::fs::remove_dir_all(&path);
    std::fs::create_dir_all(&path).unwrap();
    path
}
