"""Render a .blend with Cycles, pinned for a comparison, to a scene-linear EXR.

    blender -b file.blend --python blender/render_cycles.py -- OUT.exr [options]
    PYTHONPATH=<bpy> python3 blender/render_cycles.py file.blend OUT.exr [options]

Works in Blender 3.4, 4.5 and 5.0. With --seeds N the image is the mean over N
renders with seeds SEED … SEED + N − 1, fireflies left out per pixel (see
`robust_mean`): Cycles 3.4's Multiscatter GGX has rare ones that no number of
samples averages away. --json writes version, settings, CPU seconds and the
means of each seed.
"""

import argparse
import json
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

try:
    import bpy
    import numpy as np
    import pinned_cycles
except ImportError as missing:
    sys.exit(f"render_cycles.py: {missing}: run it by `blender -b FILE --python`, or with the bpy module")

_NODES = {"BSDF_GLOSSY", "BSDF_ANISOTROPIC", "BSDF_GLASS"}


def override(distribution=None, roughness=None):
    """Set the distribution or roughness of every Glossy, Anisotropic and Glass node."""
    for material in bpy.data.materials:
        for node in material.node_tree.nodes if material.node_tree else ():
            if node.type in _NODES:
                if distribution:
                    node.distribution = distribution
                if roughness is not None:
                    node.inputs["Roughness"].default_value = roughness


def main(args):
    """Parse, render, write."""
    parser = argparse.ArgumentParser(prog="render_cycles.py", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    if not bpy.app.binary_path:
        parser.add_argument("blend")
    parser.add_argument("out", help="the EXR to write")
    parser.add_argument("--spp", type=int, help="samples per pixel (the scene's)")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--seeds", type=int, default=1, help="how many seeds to average")
    parser.add_argument("--bounces", type=int, help="for all kinds of rays (the scene's maximum)")
    parser.add_argument("--distribution", choices=["GGX", "MULTI_GGX", "BECKMANN"])
    parser.add_argument("--roughness", type=float)
    parser.add_argument("--percent", type=int, help="of the scene's resolution")
    parser.add_argument("--half", action="store_true", help="16-bit floats")
    parser.add_argument("--scene-filter", action="store_true", help="keep the scene's pixel filter")
    parser.add_argument("--json", help="write version, settings and CPU seconds here")
    args = parser.parse_args(args)

    if not bpy.app.binary_path:
        bpy.ops.wm.open_mainfile(filepath=os.path.abspath(args.blend))
    scene = bpy.context.scene
    spp = args.spp or scene.cycles.samples
    override(args.distribution, args.roughness)
    if args.percent:
        scene.render.resolution_percentage = args.percent

    images, seconds = [], []
    for seed in range(args.seed, args.seed + args.seeds):
        pinned_cycles.pin(scene, spp, seed, args.bounces, box_filter=not args.scene_filter)
        pixels, cpu = pinned_cycles.render_array(scene)
        images.append(pixels)
        seconds.append(round(cpu, 3))
    stack = np.stack(images)
    mean, left_out = (stack[0], 0) if args.seeds == 1 else pinned_cycles.robust_mean(stack)
    os.makedirs(os.path.dirname(os.path.abspath(args.out)), exist_ok=True)
    pinned_cycles.write_exr(scene, args.out, mean, args.half)

    def channels(pixels):
        return [round(float(c), 6) for c in pixels.mean(axis=(0, 1), dtype=np.float64)]

    report = {
        "blender": pinned_cycles.version(),
        "spp": spp,
        "seeds": list(range(args.seed, args.seed + args.seeds)),
        "bounces": scene.cycles.max_bounces,
        "distribution": args.distribution,
        "roughness": args.roughness,
        "width": int(mean.shape[1]),
        "height": int(mean.shape[0]),
        "mean": channels(mean),
        "mean_per_seed": [channels(i) for i in images],
        "values_left_out": left_out,
        "cpu_seconds": seconds,
    }
    if args.json:
        with open(args.json, "w", encoding="ascii") as f:
            json.dump(report, f, indent=1)
            f.write("\n")
    print(f"wrote {args.out}: " + json.dumps(report))
    return 0


if __name__ == "__main__":
    pinned_cycles.run(main)
