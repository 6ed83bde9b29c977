//! Opening files that scenes name.

use std::fs::File;
use std::io::{Error, ErrorKind, Result};
use std::path::Path;

/// Opens a file to read, and nothing else: a pipe would be waited for without
/// end, and a device may never come to an end.
pub(crate) fn open(path: &Path) -> Result<File> {
    let kind = std::fs::metadata(path)?.file_type();
    let found = if kind.is_file() {
        return File::open(path);
    } else if kind.is_dir() {
        "a folder"
    } else {
        other(kind)
    };
    let message = format!("expected a file, found {found}");
    Err(Error::new(ErrorKind::InvalidInput, message))
}

#[cfg(unix)]
fn other(kind: std::fs::FileType) -> &'static str {
    use std::os::unix::fs::FileTypeExt;
    if kind.is_fifo() {
        "a pipe"
    } else if kind.is_socket() {
        "a socket"
    } else {
        "a device"
    }
}

#[cfg(not(unix))]
fn other(_: std::fs::FileType) -> &'static str {
    "something else"
}
