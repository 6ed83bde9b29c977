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
    // Documentation is built without linking, where no Embree is.
    println!("cargo:rerun-if-env-changed=DOCS_RS");
    if env::var_os("DOCS_RS").is_some() {
        return;
    }
    let manifest = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").expect("set by cargo"));

    let multiarch = format!(
        "lib/{}-linux-gnu",
        env::var("CARGO_CFG_TARGET_ARCH").expect("set by cargo")
    );

    if let Some(dir) = env::var_os("EMBREE_DIR").filter(|dir| !dir.is_empty()) {
        let dir = PathBuf::from(dir);
        let places = ["lib", "lib64", &multiarch, ""];
        match holder(places.map(|place| dir.join(place))) {
            Some(found) => link_from(&found),
            None => fail(&format!(
                "EMBREE_DIR is `{}`, but {LIBRARY} is neither there nor in its lib, lib64 or {multiarch}",
                dir.display()
            )),
        }
    } else if let Some(found) = holder([manifest.join(".deps/embree/lib")]) {
        link_from(&found);
    } else if let Some(found) = holder(system_folders(&multiarch)) {
        // The loader knows the way: no run path is needed.
        watch(&found);
        println!("cargo:rustc-link-search=native={}", found.display());
    } else {
        fail("Embree 4 was not found");
    }
}

/// The folders that the linker and the loader search by themselves.
fn system_folders(multiarch: &str) -> [PathBuf; 4] {
    [multiarch, "lib64", "lib", "local/lib"].map(|folder| Path::new("/usr").join(folder))
}

/// The first of `folders` that holds the library.
fn holder(folders: impl IntoIterator<Item = PathBuf>) -> Option<PathBuf> {
    folders
        .into_iter()
        .find(|folder| folder.join(LIBRARY).exists())
}

/// Runs this script again when the library in `folder` changes or goes away.
///
/// Only a file that exists may be named: Cargo takes a missing one as changed,
/// and would build the crate anew every time.
fn watch(folder: &Path) {
    println!("cargo:rerun-if-changed={}", folder.join(LIBRARY).display());
}

/// Links from `folder`, which the loader does not search, and makes programs
/// find the library there again: the run path goes into all that this package
/// links, documentation tests included.
fn link_from(folder: &Path) {
    let folder = folder
        .canonicalize()
        .unwrap_or_else(|why| fail(&format!("`{}` can't be read: {why}", folder.display())));
    watch(&folder);
    println!("cargo:rustc-link-search=native={}", folder.display());
    println!("cargo:rustc-link-arg=-Wl,-rpath,{}", folder.display());
}

fn fail(why: &str) -> ! {
    eprintln!(
        "\nerror: {why}.\n\n\
         ./setup.sh installs what is missing. By hand:\n  \
         Debian 13, Ubuntu 24.04 and newer:  apt-get install libembree-dev libclang-dev g++\n  \
         elsewhere:  install libclang and a C++ compiler, unpack Embree 4.3 or a newer 4.x,\n              \
         and set EMBREE_DIR to its folder\n"
    );
    std::process::exit(1);
}
