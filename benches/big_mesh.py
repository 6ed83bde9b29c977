#!/usr/bin/env python3
"""How long a big mesh takes from file to first ray, and how much memory.

    benches/big_mesh.py [--smithwalk BINARY]... [--triangles N] [--repeats N]

Writes a displaced torus as OBJ, with normals and texture coordinates of six
decimals, and has `smithwalk info` read it and build everything that rays need:
once for a material that looks at texture coordinates and once for one that
does not; then a small render of one sample per pixel. Commands take turns. Wall
and CPU time are medians over the repeats; memory is the most that was resident
(ru_maxrss of wait4), less what the same command takes for a single triangle.
Several binaries are compared. Prints a table for docs/speed.md.
"""

import argparse
import math
import os
import statistics
import subprocess
import sys
import tempfile
import time

ROOT = os.path.normpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))

PLAIN = "{roughness: 0.5}"
BRUSHED = "{roughness: 0.5, anisotropy: 0.5}"

SCENE = """\
smithwalk: 1
camera: {{projection: {{perspective: {{fov: 45}}}}, transform: {{look_at: {{from: [0, -10, 5], to: [0, 0, 0]}}}}}}
film: {{width: 64, height: 64}}
meshes: {{mesh: {{file: {mesh}}}}}
materials: {{metal: {{conductor: {metal}}}}}
objects: [{{mesh: mesh, material: metal}}]
world: {{constant: {{color: 0.5}}}}
"""


def write_torus(path, around):
    """A torus of 4 · around² triangles whose tube has ripples."""
    along = 2 * around
    turn = [2 * math.pi * i / along for i in range(along + 1)]
    circle = [(math.cos(a), math.sin(a)) for a in turn]
    rows = range(around + 1)
    with open(path, "w", encoding="ascii") as file:
        for j in rows:
            v = 2 * math.pi * j / around
            lines = []
            for a, (c, s) in zip(turn, circle):
                r = 1 + 0.05 * math.sin(10 * a) * math.cos(7 * v)
                lines.append(f"v {(3 + r * math.cos(v)) * c:.6f} {(3 + r * math.cos(v)) * s:.6f} "
                             f"{r * math.sin(v):.6f}\n")
            file.write("".join(lines))
        for j in rows:
            file.write("".join(f"vt {i / along:.6f} {j / around:.6f}\n" for i in range(along + 1)))
        for j in rows:
            v = 2 * math.pi * j / around
            file.write("".join(f"vn {math.cos(v) * c:.6f} {math.cos(v) * s:.6f} {math.sin(v):.6f}\n"
                               for c, s in circle))
        for j in rows[:-1]:
            lines = []
            for i in range(along):
                a = j * (along + 1) + i + 1
                b, c, d = a + 1, a + along + 2, a + along + 1
                lines.append(f"f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}\nf {a}/{a}/{a} {c}/{c}/{c} {d}/{d}/{d}\n")
            file.write("".join(lines))


def write_scene(folder, name, mesh, metal):
    """The path of a scene of one mesh."""
    path = os.path.join(folder, name + ".yaml")
    with open(path, "w", encoding="utf-8") as file:
        file.write(SCENE.format(mesh=mesh, metal=metal))
    return path


def measure(command):
    """Wall seconds, CPU seconds and peak bytes of a command."""
    start = time.perf_counter()
    # Leaves waiting to wait4, which alone tells of this process.
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    wall = time.perf_counter() - start
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        sys.exit(f"{' '.join(command)} failed")
    return wall, usage.ru_utime + usage.ru_stime, 1024 * usage.ru_maxrss


def main():
    """Parse, write, measure, print."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--smithwalk", action="append", help="a binary; may be given several times")
    parser.add_argument("--triangles", type=int, default=1_000_000, help="about so many")
    parser.add_argument("--repeats", type=int, default=7, help="of every command")
    args = parser.parse_args()
    binaries = args.smithwalk or [os.path.join(ROOT, "target", "release", "smithwalk")]
    around = max(round(math.sqrt(args.triangles / 4)), 3)
    triangles = 4 * around * around
    with tempfile.TemporaryDirectory() as folder:
        torus = os.path.join(folder, "torus.obj")
        write_torus(torus, around)
        with open(os.path.join(folder, "triangle.obj"), "w", encoding="ascii") as file:
            file.write("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        image = os.path.join(folder, "out.exr")
        rows = []
        for uvs, (kind, metal) in enumerate((("without texture coordinates", PLAIN), ("with them", BRUSHED))):
            big = write_scene(folder, "big" + str(uvs), "torus.obj", metal)
            small = write_scene(folder, "small" + str(uvs), "triangle.obj", metal)
            for what, begin, end in (("info", ["info"], []),
                                     ("render", ["render"], ["--spp", "1", "-o", image])):
                for binary in binaries:
                    name = f"`{what}`, {kind}" + (f", {os.path.basename(binary)}" if len(binaries) > 1 else "")
                    commands = [[binary, *begin, scene, *end] for scene in (big, small)]
                    rows.append((name, commands, ([], [])))
        for _ in range(args.repeats):
            for _, commands, runs in rows:
                for command, measured in zip(commands, runs):
                    measured.append(measure(command))
        size = os.path.getsize(torus) / 1e6
    print(f"{triangles:,} triangles, {size:.0f} MB, {os.cpu_count()} cores, {args.repeats} repeats:\n")
    print("| | wall, s (least) | CPU, s | peak memory, bytes per triangle |\n|---|---|---|---|")
    for name, _, (big, small) in rows:
        walls = [run[0] for run in big]
        cpu = statistics.median(run[1] for run in big)
        peak = max(run[2] for run in big) - max(run[2] for run in small)
        print(f"| {name} | {statistics.median(walls):.2f} ({min(walls):.2f}) | {cpu:.2f} "
              f"| {peak / triangles:.0f} |")


if __name__ == "__main__":
    main()
