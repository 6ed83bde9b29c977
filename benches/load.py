#!/usr/bin/env python3
"""Time and memory of scenes that are large in one way: instances, textures, triangles,
lamps, pixels.

    benches/load.py [--smithwalk BINARY] [--only NAME] [--scale FRACTION]

Each scene is made anew in a temporary folder, described by `smithwalk info --json`, and
rendered at one sample per pixel. Seconds are wall and CPU time of the whole render
process, memory is the most that was resident (ru_maxrss of wait4); `info` says
beforehand how much it will be. Prints a table for docs/speed.md.
"""

import argparse
import json
import os
import subprocess
import tempfile
import zlib

from big_mesh import ROOT, measure, write_torus

HEAD = """\
smithwalk: 1
camera: {{projection: {{perspective: {{fov: 45}}}}, transform: {{look_at: {{from: [0, -10, 6], to: [0, 0, 0]}}}}}}
film: {{width: {side}, height: {side}}}
world: {{constant: {{color: 0.5}}}}
"""

CUBE = """\
v -1 -1 -1
v 1 -1 -1
v 1 1 -1
v -1 1 -1
v -1 -1 1
v 1 -1 1
v 1 1 1
v -1 1 1
f 4 3 2 1
f 5 6 7 8
f 1 2 6 5
f 2 3 7 6
f 3 4 8 7
f 4 1 5 8
"""

QUAD = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n"


def grid(count, width):
    """So many points of a square of this width about the origin."""
    side = round(count ** 0.5 + 0.499)
    for index in range(count):
        yield tuple(width * ((k + 0.5) / side - 0.5) for k in (index % side, index // side))


def instances(folder, count):
    write(folder, "cube.obj", CUBE)
    size = 4 / count ** 0.5
    yield HEAD.format(side=512)
    yield "materials: {grey: {diffuse: {color: 0.5}}}\nmeshes: {cube: {file: cube.obj}}\nobjects:\n"
    for x, y in grid(count, 12):
        yield (f"- {{mesh: cube, material: grey, transform: {{location: [{x:.4f}, {y:.4f}, 0], "
               f"rotation: [0, 0, {(x * 71 + y * 13) % 90:.1f}], scale: {size:.5f}}}}}\n")


def png(path, side, seed):
    """A colour image of stripes that no other has."""
    row = bytes((x * (seed % 7 + 1) + 37 * c + seed) % 256 for x in range(side) for c in range(3))
    rows = zlib.compress(b"".join(b"\0" + row[3 * (y % side):] + row[:3 * (y % side)] for y in range(side)), 1)

    def chunk(kind, data):
        return len(data).to_bytes(4, "big") + kind + data + zlib.crc32(kind + data).to_bytes(4, "big")
    size = side.to_bytes(4, "big") * 2
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", size + b"\x08\x02\0\0\0") + chunk(b"IDAT", rows)
                   + chunk(b"IEND", b""))


def textures(folder, count):
    write(folder, "quad.obj", QUAD)
    for index in range(count):
        png(os.path.join(folder, f"t{index}.png"), 1024, index)
    yield HEAD.format(side=512)
    yield "meshes: {quad: {file: quad.obj}}\ntextures:\n"
    yield from (f"  t{i}: {{file: t{i}.png, color_space: srgb}}\n" for i in range(count))
    yield "materials:\n"
    yield from (f"  m{i}: {{diffuse: {{color: {{texture: t{i}}}}}}}\n" for i in range(count))
    yield "objects:\n"
    for index, (x, y) in enumerate(grid(count, 12)):
        yield f"- {{mesh: quad, material: m{index}, transform: {{location: [{x:.3f}, {y:.3f}, 0], scale: 0.25}}}}\n"


def triangles(folder, count):
    write_torus(os.path.join(folder, "torus.obj"), round((count / 4) ** 0.5))
    yield HEAD.format(side=512)
    yield "materials: {grey: {diffuse: {color: 0.5}}}\nmeshes: {torus: {file: torus.obj}}\n"
    yield "objects: [{mesh: torus, material: grey}]\n"


def lamps(folder, count):
    write(folder, "quad.obj", QUAD)
    yield HEAD.format(side=512)
    yield "materials: {grey: {diffuse: {color: 0.5}}}\nmeshes: {quad: {file: quad.obj}}\n"
    yield "objects: [{mesh: quad, material: grey, transform: {scale: 6}}]\nlights:\n"
    for x, y in grid(count, 12):
        yield f"- {{point: {{power: {1e3 / count}, radius: 0.01, transform: {{location: [{x:.3f}, {y:.3f}, 0.5]}}}}}}\n"


def pixels(folder, count):
    write(folder, "quad.obj", QUAD)
    yield HEAD.format(side=round(count ** 0.5))
    yield "materials: {grey: {diffuse: {color: 0.5}}}\nmeshes: {quad: {file: quad.obj}}\n"
    yield "objects: [{mesh: quad, material: grey, transform: {scale: 6}}]\n"


SCENES = {
    "instances": (instances, 1_000_000, "instances of a cube"),
    "textures": (textures, 500, "textures of 1024², 8 bits"),
    "triangles": (triangles, 5_000_000, "triangles, with normals"),
    "lamps": (lamps, 100_000, "lamps"),
    "pixels": (pixels, 4096 * 4096, "pixels"),
}


def write(folder, name, text):
    with open(os.path.join(folder, name), "w", encoding="ascii") as file:
        file.write(text)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--smithwalk", default=os.path.join(ROOT, "target/release/smithwalk"))
    parser.add_argument("--only", choices=SCENES, action="append", help="this scene alone; may be given several times")
    parser.add_argument("--scale", type=float, default=1.0, help="so much of each count")
    args = parser.parse_args()
    print("| scene | files, MB | ready to render, s | whole render, s | CPU, s | memory, MB | bytes each | as `info` says, MB |")
    print("|---|---|---|---|---|---|---|---|")
    for name in args.only or SCENES:
        make, count, label = SCENES[name]
        count = max(1, round(count * args.scale))
        with tempfile.TemporaryDirectory() as folder:
            scene = os.path.join(folder, "scene.yaml")
            with open(scene, "w", encoding="ascii") as file:
                file.writelines(make(folder, count))
            size = sum(entry.stat().st_size for entry in os.scandir(folder))
            told = json.loads(subprocess.run([args.smithwalk, "info", scene, "--json"],
                                             check=True, capture_output=True).stdout)
            wall, cpu, peak = measure([args.smithwalk, "render", scene, "--spp", "1",
                                        "-o", os.path.join(folder, "a.exr")])
        ready = told["start_up_seconds"]
        number = f"{count:,}".replace(",", " ")
        print(f"| {number} {label} | {size / 1e6:.0f} | {ready:.1f} | {wall:.1f} | {cpu:.1f} | {peak / 1e6:.0f} "
              f"| {peak / count:.0f} | {told['memory'] / 1e6:.0f} |", flush=True)


if __name__ == "__main__":
    main()
