"""Measure directional albedos of Cycles' Principled node, for benches/layers.py.

    PYTHONPATH=<bpy> python3 blender/measure_principled.py OUT.csv

Patches of one material each under a white world, as measure_albedo.py does it.
"""

import argparse
import csv
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "scenes"))

import bpy  # noqa: E402
import common  # noqa: E402
import measure_albedo as sheets  # noqa: E402
import pinned_cycles  # noqa: E402

COSINES = (0.9, 0.5, 0.2)
BASES = (0.02, 0.18, 0.8)
ROUGHNESSES = (0.1, 0.3, 0.5, 1.0)


def materials():
    """The sockets that differ from the defaults: plastic of several indices, coats, sheen."""
    for base in BASES:
        for roughness in ROUGHNESSES:
            yield {"base_color": base, "roughness": roughness}
    for ior in (1.2, 2.0):
        for base in BASES:
            yield {"base_color": base, "roughness": 0.3, "ior": ior}
    for coat in (0.0, 0.3):
        for base in BASES:
            yield {"base_color": base, "coat_weight": 1.0, "coat_roughness": coat}
            yield {"base_color": base, "metallic": 1.0, "roughness": 0.3, "coat_weight": 1.0,
                   "coat_roughness": coat}
    for roughness in (0.3, 1.0):
        yield {"base_color": 0.18, "sheen_weight": 1.0, "sheen_roughness": roughness}


def node(sockets):
    """A material of the node."""
    values = {key.replace("_", " ").title().replace("Ior", "IOR"): (value,) * 3 if key == "base_color" else value
              for key, value in sockets.items()}
    return common.material("Principled", "ShaderNodeBsdfPrincipled", **values)[0]


def main(args):
    """Measure all of them."""
    parser = argparse.ArgumentParser(prog="measure_principled.py")
    parser.add_argument("out")
    parser.add_argument("--spp", type=int, default=4096, help="a sixteenth of the samples per row")
    args = parser.parse_args(args)
    scene = common.empty_scene(8, 8)
    common.constant_world(scene, (1.0, 1.0, 1.0), 1.0)
    cases = list(materials())
    ob = sheets.sheet(scene, [node(sockets) for sockets in cases])
    with open(args.out, "w", newline="", encoding="utf-8") as f:
        f.write(f"# Cycles of Blender {pinned_cycles.version()}, measure_principled.py: "
                f"{args.spp * sheets.PIXELS ** 2} samples per row, BSDF sampling, seed 1\n")
        out = csv.writer(f, lineterminator="\n")
        out.writerow(["material", "cos", "albedo", "albedo_se"])
        for cosine in COSINES:
            sheets.view(scene, ob, cosine, True)
            mean, error = sheets.patches(sheets.shoot(scene, args.spp), len(cases), True)
            for sockets, value, se in zip(cases, mean[:, 0], error[:, 0]):
                said = ", ".join(f"{key}: {number:g}" for key, number in sockets.items())
                out.writerow([said, f"{cosine:g}", f"{value:.6f}", f"{se:.6f}"])
    return 0


if __name__ == "__main__":
    pinned_cycles.run(main)
