#!/bin/sh
# Rebuild scenes/: .blend by script (Blender 3.4), export, Cycles references.
#
#   blender/make_scenes.sh [gold_sphere|suzanne|sphere_rows|furnace|interior|rough_glass|brushed_metal|gallery
#                           |product_shot|daylight_room|many_lamps]...
#
# Needs `blender` 3.4 on PATH, and for the references of 4.5 and the last three
# scenes BPY45, a folder with the bpy 4.5 module (pip install --no-deps --target
# DIR bpy==4.5.15, and numpy < 2 beside it); without BPY45 those are left as they are.
# The .blend files go to out/blend and are not committed.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
root=$(dirname "$here")
blends=$root/out/blend
mkdir -p "$blends"

clear() { # scene
    mkdir -p "$root/scenes/$1"
    # All but the references comes from the export, which writes over no file that
    # an earlier one has not listed.
    find "$root/scenes/$1" -maxdepth 1 -type f ! -name 'cycles_*' -delete
}

build() { # scene
    nice blender -b --factory-startup --python "$here/scenes/$1.py" -- "$blends/$1.blend"
    clear "$1"
    nice blender -b "$blends/$1.blend" --python "$here/export.py" -- "$root/scenes/$1"
}

build45() { # scene: with the Principled node of 4.5
    [ -n "${BPY45:-}" ] || { echo "BPY45 is not set: $1 left as it is" >&2; return 0; }
    PYTHONPATH=$BPY45 nice python3 "$here/scenes/$1.py" "$blends/$1.blend"
    clear "$1"
    PYTHONPATH=$BPY45 nice python3 "$here/export.py" "$blends/$1.blend" "$root/scenes/$1"
}

cycles34() { # scene name options...: scenes/SCENE/cycles_3.4_NAME.{exr,json}
    out=$root/scenes/$1/cycles_3.4_$2 blend=$blends/$1.blend
    shift 2
    nice blender -b "$blend" --python "$here/render_cycles.py" -- \
        "$out.exr" --json "$out.json" --half "$@"
}

cycles45() { # as above
    [ -n "${BPY45:-}" ] || { echo "BPY45 is not set: $1 $2 of 4.5 left as it is" >&2; return 0; }
    out=$root/scenes/$1/cycles_4.5_$2 blend=$blends/$1.blend
    shift 2
    PYTHONPATH=$BPY45 nice python3 "$here/render_cycles.py" \
        "$blend" "$out.exr" --json "$out.json" --half "$@"
}

gold_sphere() {
    build gold_sphere
    for r in 0.5 0.8; do
        cycles34 gold_sphere "multi_ggx_r$r" --distribution MULTI_GGX --roughness $r --spp 512 --seeds 5 --seed 1
        cycles34 gold_sphere "multi_ggx_bsdf_sampling_r$r" --distribution MULTI_GGX --roughness $r \
            --no-light-sampling --percent 25 --spp 4096 --seeds 4 --seed 1
        cycles45 gold_sphere "ggx_r$r" --distribution GGX --roughness $r --spp 512 --seeds 3 --seed 1
    done
}

suzanne() {
    build suzanne
    cycles34 suzanne multi_ggx --percent 50 --spp 256 --seeds 3 --seed 1
    cycles45 suzanne ggx --percent 50 --distribution GGX --spp 128 --seeds 2 --seed 1
}

sphere_rows() {
    build sphere_rows
    cycles34 sphere_rows multi_ggx --percent 50 --spp 128 --seeds 3 --seed 1
    cycles45 sphere_rows ggx --percent 50 --distribution GGX --spp 128 --seeds 2 --seed 1
}

furnace() {
    build furnace
    cycles34 furnace multi_ggx --spp 64 --seed 1
    cycles45 furnace multi_ggx --spp 64 --seed 1
}

# Without references: benches/peers and benches/gallery.py render them.
interior() { build interior; }
rough_glass() { build rough_glass; }
brushed_metal() { build brushed_metal; }
gallery() { build gallery; }
product_shot() { build45 product_shot; }
daylight_room() { build45 daylight_room; }
many_lamps() { build45 many_lamps; }

if [ $# -eq 0 ]; then
    set -- gold_sphere suzanne sphere_rows furnace interior rough_glass brushed_metal gallery \
        product_shot daylight_room many_lamps
fi
for scene; do
    "$scene"
done
