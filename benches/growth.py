#!/usr/bin/env python3
"""How CPU time and memory grow with pixels, triangles, lamps, depth and textures.

    benches/growth.py [--smithwalk BINARY] [--only AXIS] [--docs]

One axis at a time, the scenes those of load.py and for the depth scenes/interior:
`smithwalk info` reads and builds, `smithwalk render` traces 4 samples per pixel as
well. CPU seconds are of the whole process, memory is the most that was resident
(ru_maxrss of wait4). Prints a table for each axis; with --docs they become a section
of docs/speed.md.
"""

import argparse
import os
import tempfile

import load
import section
from big_mesh import ROOT, measure

SPP, SIDE = 4, 256
INTERIOR = os.path.join(ROOT, "scenes", "interior", "scene.yaml")
AXES = {
    "pixels": (load.pixels, [256 ** 2, 512 ** 2, 1024 ** 2, 2048 ** 2]),
    "triangles": (load.triangles, [1_000, 10_000, 100_000, 1_000_000]),
    "lamps": (load.lamps, [1, 10, 100, 1_000, 10_000]),
    "bounces": (None, [0, 1, 2, 4, 8, 16, 32]),
    "textures of 1024²": (load.textures, [1, 10, 100, 400]),
}


def row(binary, axis, count):
    """A line of an axis' table."""
    make, _ = AXES[axis]
    with tempfile.TemporaryDirectory() as folder:
        scene, options = INTERIOR, ["-D", f"sampling.max_bounces={count}"]
        if make:
            scene = os.path.join(folder, "scene.yaml")
            sides = [] if axis == "pixels" else ["-D", f"film.width={SIDE}", "-D", f"film.height={SIDE}"]
            with open(scene, "w", encoding="ascii") as file:
                file.writelines(make(folder, count))
            options = sides
        _, ready, _ = measure([binary, "info", scene, *options])
        _, whole, peak = measure([binary, "render", scene, *options, "--spp", str(SPP),
                                  "-o", os.path.join(folder, "out.exr")])
    return f"| {count:,} | {ready:.2f} | {whole - ready:.2f} | {peak / 1e6:.0f} |".replace(",", " ")


def main():
    """All axes."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--smithwalk", default=os.path.join(ROOT, "target/release/smithwalk"))
    parser.add_argument("--only", choices=AXES, action="append", help="this axis alone; may be given several times")
    parser.add_argument("--docs", action="store_true", help="write the section of docs/speed.md")
    args = parser.parse_args()
    text = f"""\
```
benches/growth.py
```

One axis at a time: the scenes of `benches/load.py` at {SIDE} × {SIDE} pixels (a floor, a torus, a floor under lamps, a
quad for each texture) and `scenes/interior` for the bounces, all at {SPP} samples per pixel, on two cores that others
used as well. CPU seconds of reading and building, and of rendering beyond that; the most memory that was resident.
"""
    for axis in args.only or AXES:
        text += f"\n| {axis} | ready, CPU s | rendering, CPU s | memory, MB |\n" + "|---" * 4 + "|\n"
        for count in AXES[axis][1]:
            text += row(args.smithwalk, axis, count) + "\n"
    if args.docs:
        section.replace("How cost grows", text, os.path.join(ROOT, "docs", "speed.md"), "# Speed\n")
    print(text)


if __name__ == "__main__":
    main()
