#!/usr/bin/env bash
# Sets up, then checks everything: format, lints, documentation, tests, scripts.
# A failing stage does not stop the others; the end names every one.
set -uo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")" || exit
PATH=$PATH:${HOME:-/root}/.cargo/bin

failed=() times=()
stage() {
    local name=$1 begin=$SECONDS outcome=ok
    shift
    printf '\n== %s\n' "$name"
    "$@" || { outcome=FAILED && failed+=("$name"); }
    times+=("$(printf '%5d s  %-14s %s' $((SECONDS - begin)) "$name" $outcome)")
}

results=$(mktemp)
trap 'rm -f "$results"' EXIT
documentation() { RUSTDOCFLAGS='-D warnings' cargo doc --workspace --no-deps; }
tests() { cargo test --workspace --no-fail-fast 2>&1 | tee "$results"; }
scripts() { find . \( -path ./target -o -path ./.deps -o -path ./.git \) -prune -o "$@" -print0; }
shell_syntax() { scripts -name '*.sh' | xargs -0 -n 1 bash -n && bash -n .ci/run; }
# The Python package as users get it: a wheel in a virtual environment with numpy alone.
python_package() {
    local venv=target/python
    { [[ -x $venv/bin/maturin ]] || { python3 -m venv $venv && $venv/bin/pip install -q maturin pytest numpy OpenEXR; }; } &&
        rm -rf $venv/wheel && $venv/bin/maturin build -m python/Cargo.toml --out $venv/wheel &&
        $venv/bin/pip install -q --force-reinstall --no-deps $venv/wheel/*.whl &&
        $venv/bin/python -m pytest -q python/tests
}
# Skips itself where its daemons can't be started.
slurm() { tests/slurm.sh target/debug/smithwalk || [[ $? -eq 77 ]]; }
python_syntax() { scripts -name '*.py' | PYTHONPYCACHEPREFIX=target/pycache xargs -0 python3 -m py_compile; }

stage set-up ./setup.sh --with-lints --with-python --with-blender --with-denoiser --with-slurm
[[ ${#failed[@]} -eq 0 ]] || exit 1
stage shell shell_syntax
stage python python_syntax
stage format cargo fmt --all --check
stage clippy cargo clippy --locked --workspace --all-targets -- -D warnings
stage documentation documentation
stage tests tests
stage python-package python_package
stage extending tests/extending.sh
stage slurm slurm

printf '\n== summary\n'
grep '^test result:' "$results"
printf '%s\n' "${times[@]}" "$(printf '%5d s  in all' $SECONDS)"
awk '/^test result:/ { passed += $4; failed += $6; skipped += $8 }
     END { printf "%d passed, %d failed, %d skipped\n", passed, failed, skipped }' "$results"
if [[ ${#failed[@]} -gt 0 ]]; then
    printf 'failed: %s\n' "${failed[*]}" >&2
    exit 1
fi
