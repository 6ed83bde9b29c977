#!/usr/bin/env bash
# Sets up, builds, and renders Suzanne in rough gold. The last line is the path
# of the image.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"
PATH=$PATH:${HOME:-/root}/.cargo/bin

./setup.sh
cargo build --release --locked
mkdir -p out
target/release/smithwalk render scenes/suzanne/scene.yaml --spp 8 -o out/suzanne.exr -o out/suzanne.png
printf '%s\n' "$PWD/out/suzanne.png"
