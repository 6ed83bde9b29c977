"""Measure the sheen of Cycles 4 and later: how much light it turns, and where to.

    PYTHONPATH=<bpy> python3 blender/measure_sheen.py OUT.csv

For each roughness and cosθ_o the albedo R and the means of cosθ_i and of the component of
ω_i along the projection of ω_o, over the lobe f·cosθ_i / R. Rendered as measure_albedo.py
does it, under worlds of the colours 1, z and (1 + y)/2.
"""

import argparse
import csv
import math
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "scenes"))

import bpy  # noqa: E402
import common  # noqa: E402
import measure_albedo as sheets  # noqa: E402
import numpy as np  # noqa: E402
import pinned_cycles  # noqa: E402

ROUGHNESSES = tuple(i / 20 for i in range(1, 21))
COSINES = (0.02, 0.04, 0.06, 0.09, 0.12, 0.16, 0.2, 0.25, 0.3, 0.36, 0.43, 0.5, 0.58, 0.66, 0.75, 0.84, 0.92, 0.999)


def moments_world(scene):
    """Radiance (1, max(z, 0), (1 + y)/2)."""
    common.constant_world(scene, (0.0, 0.0, 0.0), 1.0)
    tree = scene.world.node_tree
    names = ("TexCoord", "SeparateXYZ", "Math", "Math", "CombineXYZ")
    coordinates, separate, up, along, combine = (tree.nodes.new(f"ShaderNode{n}") for n in names)
    up.operation, along.operation = "MAXIMUM", "MULTIPLY_ADD"
    up.inputs[1].default_value = 0.0
    along.inputs[1].default_value = along.inputs[2].default_value = 0.5
    background = next(n for n in tree.nodes if n.type == "BACKGROUND")
    tree.links.new(coordinates.outputs["Generated"], separate.inputs[0])
    tree.links.new(separate.outputs["Z"], up.inputs[0])
    tree.links.new(separate.outputs["Y"], along.inputs[0])
    combine.inputs[0].default_value = 1.0
    tree.links.new(up.outputs[0], combine.inputs[1])
    tree.links.new(along.outputs[0], combine.inputs[2])
    tree.links.new(combine.outputs[0], background.inputs["Color"])


def main(args):
    """Measure all of them."""
    parser = argparse.ArgumentParser(prog="measure_sheen.py")
    parser.add_argument("out")
    parser.add_argument("--spp", type=int, default=4096, help="a sixteenth of the samples per row")
    args = parser.parse_args(args)
    scene = common.empty_scene(8, 8)
    moments_world(scene)
    materials = [common.material("Sheen", "ShaderNodeBsdfSheen", Color=(1.0, 1.0, 1.0), Roughness=r)[0]
                 for r in ROUGHNESSES]
    ob = sheets.sheet(scene, materials)
    with open(args.out, "w", newline="", encoding="utf-8") as f:
        f.write(f"# Cycles of Blender {pinned_cycles.version()}, measure_sheen.py, "
                f"{args.spp * sheets.PIXELS ** 2} samples per row, seed 1\n")
        out = csv.writer(f, lineterminator="\n")
        out.writerow(["roughness", "cos", "albedo", "mean_z", "mean_x", "albedo_se"])
        for cosine in COSINES:
            sheets.view(scene, ob, cosine, True)
            mean, error = sheets.patches(sheets.shoot(scene, args.spp), len(materials), True)
            for roughness, (albedo, z, along), (se, _, _) in zip(ROUGHNESSES, mean, error):
                # The viewer is at −y.
                row = (albedo, z / albedo, 1.0 - 2.0 * along / albedo, se)
                out.writerow([f"{roughness:g}", f"{cosine:g}", *(f"{v:.6f}" for v in row)])
    return 0


if __name__ == "__main__":
    pinned_cycles.run(main)
