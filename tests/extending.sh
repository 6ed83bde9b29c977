#!/usr/bin/env bash
# Applies each worked example of CONTRIBUTING.md to a copy of the source, and
# has the compiler check it. The first line of a patch says how many files it
# may touch.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

copy=$PWD/target/extending/tree
rm -rf "$copy"
mkdir -p "$copy"
git ls-files -z -- Cargo.toml Cargo.lock build.rs .cargo src crates python docs/extending docs/scene-format.md examples benches tests |
    xargs -0 cp --parents -t "$copy"
[[ ! -d .deps ]] || ln -s "$PWD/.deps" "$copy/.deps"

export CARGO_TARGET_DIR=$PWD/target/extending/build GIT_CEILING_DIRECTORIES=$PWD/target/extending
cd "$copy"
for patch in docs/extending/*.patch; do
    most=$(sed -n '1s/.*at most \([0-9]*\) files.*/\1/p' "$patch")
    touched=$(git apply --numstat "$patch" | wc -l)
    if [[ -z $most || $touched -gt $most ]]; then
        printf '%s touches %s files; its first line allows %s\n' "$patch" "$touched" "${most:-no number}" >&2
        exit 1
    fi
    git apply "$patch" || { printf '%s no longer applies: mend it\n' "$patch" >&2 && exit 1; }
    cargo check --quiet --locked -p smithwalk -p smithwalk-validation --lib || { printf '%s no longer compiles: mend it\n' "$patch" >&2 && exit 1; }
    git apply --reverse "$patch"
    printf '%s: %s files, compiles\n' "$patch" "$touched"
done
