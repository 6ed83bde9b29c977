//! Finds Embree 4 and tells the linker where it is, now and at run time.
//!
//! Looked for, in this order: `$EMBREE_DIR` (the prefix, or the folder that
//! holds the library), `.deps/embree` beside this file (where `setup.sh` puts
//! the library on systems that package only Embree 3), the system's own
//! library folders.

use std::env;
use std::path::{Path, PathBuf};

const LIBRARY: &str = "libembree4.so";

fn main() {
    println!("cargo:rerun-if-env-changed=EMBREE_DIR");
    println!("cargo:rerun-if-changed=build.rs");
    let manifest = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").expect("set by cargo"));
    let private = manifest.join(".deps/embree/lib");
    println!("cargo:rerun-if-changed={}", private.display());

    if let Some(dir) = env::var_os("EMBREE_DIR").map(PathBuf::from) {
        let found = [dir.join("lib"), dir.join("lib64"), dir.clone()]
            .into_iter()
            .find(|d| d.join(LIBRARY).exists());
        match found {
            Some(dir) => return link_from(&dir),
            None => fail(&format!(
                "EMBREE_DIR is {}, but neither it nor its lib or lib64 folder holds {LIBRARY}",
                dir.display()
            )),
        }
    }
    if private.join(LIBRARY).exists() {
        return link_from(&private);
    }
    if let Some(dir) = system_folders()
        .into_iter()
        .find(|d| d.join(LIBRARY).exists())
    {
        println!("cargo:rustc-link-search=native={}", dir.display());
        return;
    }
    fail("Embree 4 was not found");
}

/// The folders that the linker and the loader search by themselves.
fn system_folders() -> Vec<PathBuf> {
    let arch = env::var("CARGO_CFG_TARGET_ARCH").unwrap_or_default();
    vec![
        PathBuf::from(format!("/usr/lib/{arch}-linux-gnu")),
        PathBuf::from("/usr/lib64"),
        PathBuf::from("/usr/lib"),
        PathBuf::from("/usr/local/lib"),
    ]
}

/// Links from `dir` and makes the programs find the library there again.
fn link_from(dir: &Path) {
    let dir = dir.canonicalize().unwrap_or_else(|_| dir.to_path_buf());
    println!("cargo:rustc-link-search=native={}", dir.display());
    println!("cargo:rustc-link-arg=-Wl,-rpath,{}", dir.display());
}

fn fail(why: &str) -> ! {
    eprintln!(
        "\n{why}.\n\n\
         ./setup.sh installs it. By hand:\n  \
         Debian 13 or Ubuntu 24.04 and newer:  apt-get install libembree-dev libclang-dev\n  \
         elsewhere: unpack an Embree 4.3 or newer and set EMBREE_DIR to its folder\n"
    );
    std::process::exit(1);
}
