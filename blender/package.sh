#!/bin/sh
# Build the Blender extension: the add-on, the stripped binary, and Embree and TBB beside it.
#
#   blender/package.sh [OUT.zip]       (out/smithwalk_blender.zip)
#
# Installs in Blender 4.2 and newer by Edit > Preferences > Get Extensions >
# Install from Disk, in 3.4 by Add-ons > Install. Needs target/release/smithwalk,
# strip, patchelf and zip (or python3).
set -eu
here=$(cd "$(dirname "$0")" && pwd)
root=$(dirname "$here")
out=${1:-$root/out/smithwalk_blender.zip}
binary=$root/target/release/smithwalk
[ -x "$binary" ] || { echo "package.sh: $binary is missing: cargo build --release" >&2; exit 1; }
for tool in strip patchelf; do
    command -v $tool >/dev/null || { echo "package.sh: $tool is missing" >&2; exit 1; }
done

stage=$(mktemp -d)
trap 'rm -rf "$stage"' EXIT
addon=$stage/smithwalk_export
mkdir -p "$addon/bin" "$(dirname "$out")"
cp "$here"/smithwalk_export/*.py "$here/smithwalk_export/blender_manifest.toml" "$addon/"
cp "$root"/LICENSE* "$addon/" 2>/dev/null || true
strip -o "$addon/bin/smithwalk" "$binary"

# Embree and what it brings along, by the names that the loader looks for.
ldd "$binary" | awk '$3 ~ /^\// { print $1, $3 }' | while read -r name path; do
    case $name in
        libembree4*|libtbb*) cp -L "$path" "$addon/bin/$name"; chmod u+w "$addon/bin/$name"
            patchelf --set-rpath '$ORIGIN' "$addon/bin/$name" ;;
    esac
done
patchelf --set-rpath '$ORIGIN' "$addon/bin/smithwalk"

rm -f "$out"
# The extension's files at the top for 4.2 and newer; for 3.4 the folder around them.
python3 - "$stage" "$out" <<'PY'
import os, sys, zipfile
stage, out = sys.argv[1:]
with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
    for folder, _, names in sorted(os.walk(stage)):
        for name in sorted(names):
            path = os.path.join(folder, name)
            archive.write(path, os.path.relpath(path, stage))
PY
echo "$out: $(du -m "$out" | cut -f1) MB"
