#!/bin/bash
# Fills fuzz/corpus/ with small valid inputs of every kind to start from, all made here
# or taken from the repository: fuzz/seeds.sh [SMITHWALK]
set -euo pipefail
cd "$(dirname "$0")/.."
smithwalk=$(realpath "${1:-target/release/smithwalk}")
corpus=$PWD/fuzz/corpus
mkdir -p "$corpus"/{scene,frame,overrides,material,mesh,texture,image,film}

# Copies files of at most so many bytes, named after their paths.
copy() {
    local to=$1 largest=$2 file
    shift 2
    for file in "$@"; do
        [[ $(stat -c %s "$file") -le $largest ]] && cp "$file" "$corpus/$to/${file//\//_}"
    done
    return 0
}
shopt -s globstar
copy scene 8000 scenes/*/*.yaml tests/data/**/scene.yaml
copy mesh 4000 scenes/**/*.obj tests/data/parity/*/cycles_4.5/*.obj
copy texture 8000 tests/data/*.exr tests/data/**/*.png scenes/**/*.png
copy image 8000 tests/data/*.exr tests/data/parity/*/cycles_4.5/*.exr

scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
cat > "$scratch/scene.yaml" <<END
smithwalk: 1
camera: {projection: {perspective: {fov: 40}}, transform: {location: [0, 0, 3]}}
film: {width: 3, height: 2, aovs: [albedo, normal, depth, variance]}
world: {constant: {color: [0.2, 0.3, 0.4]}}
END
"$smithwalk" render "$scratch/scene.yaml" --spp 2 -o "$scratch/a.film" -o "$scratch/a.exr" -o "$scratch/a.png" > /dev/null
# The target adds the magic bytes and the sum itself.
head -c -16 "$scratch/a.film" | tail -c +17 > "$corpus/film/aovs"
printf 'LUT_3D_SIZE 2\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 0 1\n1 0 1\n0 1 1\n1 1 1\n' > "$scratch/view.cube"
"$smithwalk" render "$scratch/scene.yaml" --spp 3 -D film.aovs=[] --part 1/2 -o "$scratch/b.film" \
    -D 'film.view={lut: view.cube, log2: {offset: 1, min: 0, max: 4}}' > /dev/null
head -c -16 "$scratch/b.film" | tail -c +17 > "$corpus/film/part"
cp "$scratch/a.exr" "$corpus/image/aovs.exr"
cp "$scratch/a.exr" "$corpus/texture/aovs.exr"
cp "$scratch/a.png" "$corpus/texture/a.png"

python3 - "$corpus" <<'END'
import struct, sys, zlib
corpus = sys.argv[1]
def write(name, data):
    with open(f"{corpus}/{name}", "wb") as file:
        file.write(data if isinstance(data, bytes) else data.encode())

rough = "roughness: 0.4, anisotropy: 0.3, rotation: 0.1, distribution: beckmann"
for name, text in {
    "conductor": f"conductor: {{{rough}, metal: gold}}",
    "f82": "conductor: {alpha: 0.3, f0: [1, 0.8, 0.4], f82: 0.9, scattering: single}",
    "complex": "conductor: {alpha_x: 0.3, alpha_y: 0.1, eta: [0.2, 0.9, 1.1], k: [3.9, 2.5, 2.1], tangent: {radial: z}}",
    "dielectric": f"dielectric: {{{rough}, ior: 1.4, color: 0.9}}",
    "mix": "mix: {factor: {fresnel: {ior: 1.4}}, a: {diffuse: {color: 0.3}}, b: {sum: {a: {velvet: {sigma: 0.4}}, b: {emission: {strength: 2}}}}}",
    "principled": "principled: {version: 3.4, clearcoat: 0.5, sheen: 0.2, specular_tint: 0.3, transmission: 0.1}",
    "principled5": "principled: {version: 5.0, coat_weight: 0.5, metallic: 0.2, alpha: 0.5, layering: cycles}",
    "layered": "layered: {interfaces: [{ior: 1.5, alpha: 0.1, absorption: [0.1, 0.2, 0.3], thickness: 1}], base: {diffuse: {color: 0.5}}}",
}.items():
    write(f"material/{name}", text)
for name, changes in {
    "nested": "objects.0.transform.location.2=1\0materials.m.n.diffuse.color=[1, .5, 0]",
    "whole": "camera={projection: {orthographic: {scale: 2}}}\0film.aovs=[depth]",
    "lights": "lights.0.point.power=1e3\0world.constant.strength=.5",
}.items():
    write(f"overrides/{name}", changes)
for name, text in {
    "moves": "camera.transform: {look_at: {from: [0, -3, 2], to: [0, 0, 0]}}\nobjects.0.transform.location: [1, 2, 3]\nmeshes.a.file: b.obj\n",
    "values": "lights.0.point: {power: 3, radius: .1}\nmaterials.m.n.diffuse.color: .5\n",
}.items():
    write(f"frame/{name}", text)
write("mesh/all", "o a\nv 0 0 0\nv 1 0 0 1 0 0\nv 1 1 0\nv 0 1 0 2\nvt 0 0\nvt 1 0\nvt 1 1\nvn 0 0 1\nusemtl m\nf 1/1/1 2/2/1 3/3/1 4/1/1\nf -1//1 -2//1 -3//1\nl 1 2\np 1\ng x\ns off\nf 1 2 \\\n3\n")

def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
def png(bits, kind, channels, extra=b""):
    row = b"\0" + bytes(range(1, 1 + (2 * bits * channels + 7) // 8))
    header = struct.pack(">IIBBBBB", 2, 2, bits, kind, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + extra + chunk(b"IDAT", zlib.compress(row * 2)) + chunk(b"IEND", b"")
write("texture/grey1.png", png(1, 0, 1))
write("texture/rgb16.png", png(16, 2, 3, chunk(b"gAMA", struct.pack(">I", 45455))))
write("texture/palette.png", png(8, 3, 1, chunk(b"PLTE", bytes(range(60)))))
write("texture/flat.hdr", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=1\n\n-Y 2 +X 2\n" + bytes([90, 80, 70, 128] * 4))
write("texture/runs.hdr", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 8\n" + bytes([2, 2, 0, 8]) + bytes([136, 90]) * 4)
def tiff(samples, bits, form):
    pixels = bytes(range(1, 1 + 4 * samples * bits // 8))
    tags = [(256, 3, 2), (257, 3, 2), (258, 3, bits), (259, 3, 1), (262, 3, 1 if samples == 1 else 2),
            (273, 4, 8), (277, 3, samples), (278, 3, 2), (279, 4, len(pixels)), (339, 3, form)]
    if samples > 1:
        tags = [tag for tag in tags if tag[0] != 258] + [(258, 3, bits)]
        tags.sort()
    data = b"II*\0" + struct.pack("<I", 8 + len(pixels)) + pixels
    data += struct.pack("<H", len(tags))
    for tag, kind, value in tags:
        data += struct.pack("<HHI", tag, kind, 1) + struct.pack("<I", value)
    return data + struct.pack("<I", 0)
write("texture/grey8.tiff", tiff(1, 8, 1))
write("texture/grey32.tiff", tiff(1, 32, 3))
END
find "$corpus" -mindepth 1 -maxdepth 1 -type d | while read -r kind; do
    echo "$(find "$kind" -type f | wc -l) seeds for $(basename "$kind")"
done
