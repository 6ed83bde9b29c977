#!/usr/bin/env bash
# Installs what the build needs, and nothing that is there already.
# For Debian 12, Debian 13 and Ubuntu 24.04, as root or with sudo; with neither
# it says what to install and fails. A second call changes nothing.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

usage() {
    cat <<'END'
usage: ./setup.sh [--with-lints] [--with-python] [--with-blender]
                  [--with-denoiser] [--with-slurm]

  --with-lints     also cargo fmt and cargo clippy
  --with-python    also what builds and tests the Python package
  --with-blender   also the distribution's Blender, for reference renders and
                   the tests of the exporter
  --with-denoiser  also Open Image Denoise, for `smithwalk render --denoise`
                   (x86-64; 84 MB to fetch, 56 MB to keep)
  --with-slurm     also Slurm, whose daemons the test of farm/slurm starts

EMBREE_DIR names an Embree 4.3 or newer to use instead of the distribution's.
END
}

RUST=1.85
EMBREE=4.3
# Debian 12 packages only Embree 3. There the library comes out of this wheel.
WHEEL=embreex==4.4.0.post1
WHEEL_SHA256=2cd0f7d5c6342e6247e31f700761689cae7829454d8c6de0c41e62124a023e1f
PRIVATE=.deps/embree
# The denoiser's library, of which no distribution packages this version.
OIDN_WHEEL=pyoidn==2.5.1.0
OIDN_SHA256=32ad13368f8de1ef63001942ad05b02a00cd732d1206d97f352d3a3f606d823e
OIDN=.deps/oidn

lints=false python=false blender=false denoiser=false slurm=false
for option in "$@"; do
    case $option in
        --with-lints) lints=true ;;
        --with-python) python=true ;;
        --with-blender) blender=true ;;
        --with-denoiser) denoiser=true ;;
        --with-slurm) slurm=true ;;
        -h | --help) usage && exit 0 ;;
        *) usage >&2 && exit 2 ;;
    esac
done

say() { printf 'setup: %s\n' "$*" >&2; }
die() { say "$@" && exit 1; }
has() { command -v "$1" >/dev/null 2>&1; }
at_least() { [[ $(printf '%s\n' "$2" "$1" | sort -V | head -n 1) == "$2" ]]; }
exists() { compgen -G "$1" >/dev/null; }

# What is there?

libclang_is_here() {
    [[ -n ${LIBCLANG_PATH:-} ]] && return
    # The library, and the compiler's own headers, which bindgen reads too.
    { exists '/usr/lib/llvm-*/lib/libclang[.-][s0-9]*' || exists '/usr/lib*/libclang.so*'; } &&
        { exists '/usr/lib/llvm-*/lib/clang/*/include/stddef.h' || exists '/usr/lib*/clang/*/include/stddef.h'; }
}

# The same places, in the same order, as build.rs.
embree_is_here() {
    local multiarch dir version
    multiarch=lib/$(uname -m)-linux-gnu
    if [[ -n ${EMBREE_DIR:-} ]]; then
        for dir in "$EMBREE_DIR"/{lib,lib64,"$multiarch",.}; do
            [[ -e $dir/libembree4.so ]] && return
        done
        die "EMBREE_DIR is '$EMBREE_DIR', but libembree4.so is neither there nor in its lib, lib64 or $multiarch"
    fi
    [[ -e $PRIVATE/lib/libembree4.so ]] && return
    for dir in "/usr/$multiarch" /usr/lib64 /usr/lib /usr/local/lib; do
        if [[ -e $dir/libembree4.so ]]; then
            version=$(dpkg-query -W -f '${Version}' libembree-dev 2>/dev/null) || return 0
            at_least "$version" $EMBREE && return
        fi
    done
    return 1
}

cargo_is_here() {
    local version
    version=$(cargo --version 2>/dev/null | cut -d ' ' -f 2) && at_least "$version" $RUST
}

PATH=$PATH:${HOME:-/root}/.cargo/bin
packages=() need_cargo=false need_embree=false
{ has cc && has c++; } || packages+=(g++)
libclang_is_here || packages+=(libclang-dev)
embree_is_here || need_embree=true
cargo_is_here || need_cargo=true
if $python; then
    python3 -c 'import ensurepip, venv' 2>/dev/null || packages+=(python3 python3-venv)
fi
if $blender; then
    has blender || packages+=(blender)
    # For the distribution's Blender, which runs the distribution's Python.
    /usr/bin/python3 -c 'import numpy' 2>/dev/null || packages+=(python3-numpy)
fi
if $slurm; then
    has slurmctld || packages+=(slurmctld slurmd slurm-client munge)
fi
if $lints && ! $need_cargo && ! { cargo fmt --version && cargo clippy --version; } >/dev/null 2>&1; then
    has rustup && die "cargo fmt or cargo clippy is missing: rustup component add rustfmt clippy"
    packages+=(rustfmt rust-clippy)
fi
if $denoiser; then
    if [[ -e $OIDN/lib/libOpenImageDenoise.so.2 ]]; then
        denoiser=false
    elif [[ $(uname -m) != x86_64 ]]; then
        die "Open Image Denoise is fetched for x86-64 alone: set OIDN_DIR to a folder that holds version 2"
    elif ! python3 -m pip --version >/dev/null 2>&1; then
        packages+=(python3-pip)
    fi
fi
if [[ ${#packages[@]} -eq 0 ]] && ! $need_cargo && ! $need_embree && ! $denoiser; then
    exit 0
fi

# What can be had?

as_root=() may_install=true
if ! has apt-get; then
    may_install=false
elif [[ $EUID -ne 0 ]]; then
    as_root=(sudo)
    # Ask for a password only where somebody can type it.
    sudo -n true 2>/dev/null || { [[ -t 0 ]] && has sudo && sudo -v; } || may_install=false
fi

log=$(mktemp)
trap 'rm -rf "$log" .deps/new' EXIT
apt_get() {
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
        apt-get -y -q -o DPkg::Lock::Timeout=300 "$@" </dev/null >"$log" 2>&1
}
apt_offers() {
    local candidate
    candidate=$(LC_ALL=C apt-cache policy "$1" 2>/dev/null | sed -n 's/^  Candidate: //p')
    [[ $candidate =~ ^[0-9] ]] && at_least "$candidate" "$2"
}
can_unpack_wheel() { [[ $(uname -m) == x86_64 ]]; }
has_pip() { python3 -m pip --version >/dev/null 2>&1; }

if $may_install; then
    say "reading the package lists"
    apt_get update || say "warning: apt-get update failed: $(tail -n 1 "$log")"
fi

if $need_cargo && ! has rustup && apt_offers cargo $RUST; then
    packages+=(cargo ca-certificates)
    ! $lints || packages+=(rustfmt rust-clippy)
    need_cargo=false
fi

need_wheel=false
if $need_embree; then
    # Without the right to install, a wheel in this folder does as well.
    if apt_offers libembree-dev $EMBREE && { $may_install || ! has_pip || ! can_unpack_wheel; }; then
        packages+=(libembree-dev)
    elif can_unpack_wheel; then
        need_wheel=true
        has_pip || packages+=(python3-pip)
    else
        die "no Embree $EMBREE or newer is packaged for $(uname -m) here: build it and set EMBREE_DIR to its folder"
    fi
fi

# Get it.

if [[ ${#packages[@]} -gt 0 ]]; then
    if ! $may_install; then
        say "these are missing and need root or sudo to install:"
        say "    apt-get update && apt-get install ${packages[*]}"
        ! $need_cargo || say "and Rust $RUST or newer, which needs neither: https://rustup.rs"
        exit 1
    fi
    say "installing ${packages[*]}"
    apt_get install --no-install-recommends "${packages[@]}" || {
        cat "$log" >&2
        die "apt-get install ${packages[*]} failed, see above"
    }
fi

# A wheel to .deps/new. The Python named here only picks the wheel; nothing of it is run.
fetch() {
    rm -rf .deps/new
    mkdir -p .deps/new
    printf '%s --hash=sha256:%s\n' "$1" "$2" >.deps/new/requirements.txt
    python3 -m pip download --quiet --disable-pip-version-check --no-deps --only-binary=:all: \
        --implementation cp --python-version 3.11 --platform manylinux_2_28_x86_64 --platform manylinux2014_x86_64 \
        --require-hashes --requirement .deps/new/requirements.txt --dest .deps/new >"$log" 2>&1 || {
        cat "$log" >&2
        die "pip could not download $1, see above"
    }
}

if $need_wheel; then
    say "fetching Embree from the wheel $WHEEL"
    fetch "$WHEEL" "$WHEEL_SHA256"
    python3 - <<'END'
import ctypes, pathlib, zipfile

new = pathlib.Path(".deps/new")
(wheel,) = new.glob("*.whl")
(new / "lib").mkdir()
with zipfile.ZipFile(wheel) as archive:
    for name in archive.namelist():
        if name.startswith("embreex.libs/lib"):
            (new / "lib" / pathlib.Path(name).name).write_bytes(archive.read(name))
wheel.unlink()
(library,) = (new / "lib").glob("libembree4-*.so.4")
(new / "lib" / "libembree4.so").symlink_to(library.name)
ctypes.CDLL(str(library.resolve()))  # raises where a library that it needs is missing
END
    rm -rf $PRIVATE
    mkdir -p $PRIVATE
    mv .deps/new/lib $PRIVATE/lib
fi

if $denoiser; then
    say "fetching Open Image Denoise from the wheel $OIDN_WHEEL"
    fetch "$OIDN_WHEEL" "$OIDN_SHA256"
    python3 - <<'END'
import ctypes, pathlib, zipfile

new = pathlib.Path(".deps/new")
(wheel,) = new.glob("*.whl")
(new / "lib").mkdir()
wanted = {"libOpenImageDenoise.so.2", "libOpenImageDenoise_core.so.2.5.1",
          "libOpenImageDenoise_device_cpu.so.2.5.1", "libtbb.so.12"}
with zipfile.ZipFile(wheel) as archive:
    for name in archive.namelist():
        file = pathlib.Path(name).name
        if file in wanted:
            (new / "lib" / file).write_bytes(archive.read(name))
wheel.unlink()
ctypes.CDLL(str((new / "lib" / "libOpenImageDenoise.so.2").resolve()))
END
    rm -rf $OIDN
    mkdir -p $OIDN
    mv .deps/new/lib $OIDN/lib
fi

if $need_cargo; then
    if has rustup; then
        die "cargo is older than $RUST or has no toolchain: rustup update stable && rustup default stable"
    fi
    apt_offers rustup 0 && how="apt-get install rustup && rustup default stable" || how="https://rustup.rs"
    die "Rust $RUST or newer is missing and not packaged here; get it with: $how"
fi
say "done"
