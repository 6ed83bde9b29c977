"""White spheres in a white world, in Cycles and in smithwalk.

    blender -b --factory-startup --python blender/compare_furnace.py -- OUT_DIR [--smithwalk PATH]
    PYTHONPATH=<bpy> python3 blender/compare_furnace.py OUT_DIR

A ball of metal or closed glass fills the frame of an orthographic camera, in a
world of radiance 1 that is found by BSDF sampling alone. What the image's mean
lacks of 1 is energy that the closure loses. The ball is shaded flat:
interpolated normals leak light at the silhouette, which is another story.

Writes OUT_DIR/cycles_<major.minor>_furnace.csv, with the mean over --seeds
images and its standard error from their scatter, and OUT_DIR/<material>/, the
same scene for smithwalk. With --smithwalk that is rendered too, by `smithwalk
furnace`, to OUT_DIR/smithwalk_furnace.csv.
"""

import argparse
import csv
import json
import os
import subprocess
import sys

here = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [here, os.path.join(here, "scenes")]

import bpy  # noqa: E402
import common  # noqa: E402
import numpy as np  # noqa: E402
import pinned_cycles  # noqa: E402
from smithwalk_export.scene import export  # noqa: E402

ROUGHNESSES = (0.5, 0.8, 1.0)
WHITE = (1.0, 1.0, 1.0)
BOUNCES = 1024
PIXELS = 64
HEADER = ("material", "scattering", "roughness", "mean", "se", "samples")


def scene_of(kind):
    """A ball of one material; returns the scene and the shader node."""
    scene = common.empty_scene(PIXELS, PIXELS, bounces=BOUNCES)
    ball = common.sphere("Ball", (0.0, 0.0, 0.0), segments=128, rings=64)
    for polygon in ball.data.polygons:
        polygon.use_smooth = False
    make = common.glass if kind == "glass" else lambda *a: common.conductor(a[0], WHITE, a[1])
    material = make(kind, 0.5)
    ball.data.materials.append(material)
    common.constant_world(scene, WHITE, 1.0)
    scene.world.cycles.sampling_method = "NONE"
    camera = common.camera(scene, (0.0, -9.0, 0.0), (0.0, 0.0, 0.0), 28.0)
    camera.data.type, camera.data.ortho_scale = "ORTHO", 1.3  # inside the ball's outline
    return scene, next(n for n in material.node_tree.nodes if "Roughness" in n.inputs)


def write(path, comment, rows):
    """A CSV under one comment line."""
    with open(path, "w", newline="", encoding="ascii") as f:
        f.write(f"# {comment}\n")
        out = csv.writer(f, lineterminator="\n")
        out.writerow(HEADER)
        out.writerows(rows)
    print(f"wrote {path}: {len(rows)} rows")


def with_cycles(kind, spp, seeds):
    """Rows of Cycles."""
    scene, node = scene_of(kind)
    rows = []
    for distribution in ("MULTI_GGX", "GGX"):
        node.distribution = distribution
        for roughness in ROUGHNESSES:
            node.inputs["Roughness"].default_value = roughness
            means = []
            for seed in range(seeds):
                pinned_cycles.pin(scene, spp, seed, BOUNCES)
                means.append(pinned_cycles.render_array(scene)[0].mean(dtype=np.float64))
            error = np.std(means, ddof=1) / np.sqrt(seeds)
            scattering = "multiple" if distribution == "MULTI_GGX" else "single"
            rows.append((kind, scattering, roughness, f"{np.mean(means):.6f}", f"{error:.6f}",
                         spp * seeds * PIXELS * PIXELS))
            print(*rows[-1], flush=True)
    return rows


def with_smithwalk(program, path, kind, spp):
    """Rows of smithwalk, for the exported scene."""
    tag = "dielectric" if kind == "glass" else "conductor"
    rows = []
    for scattering in ("multiple", "single"):
        for roughness in ROUGHNESSES:
            run = subprocess.run(
                [program, "furnace", path, "--json", "--spp", str(spp),
                 "-D", f"materials.{kind}.{tag}.roughness={roughness}",
                 "-D", f"materials.{kind}.{tag}.scattering={scattering}"],
                check=True, capture_output=True, encoding="utf-8")
            found = json.loads(run.stdout)
            rows.append((kind, scattering, roughness, f"{found['mean']:.6f}", f"{found['se']:.6f}",
                         spp * found["pixels"]))
            print(*rows[-1], flush=True)
    return rows


def main(args):
    """Measure with Cycles, then with smithwalk."""
    parser = argparse.ArgumentParser(prog="compare_furnace.py")
    parser.add_argument("out")
    parser.add_argument("--spp", type=int, default=128, help="samples per pixel of an image")
    parser.add_argument("--seeds", type=int, default=8, help="images, at least 2")
    parser.add_argument("--smithwalk", help="the program, to render the exported scenes")
    args = parser.parse_args(args)
    os.makedirs(args.out, exist_ok=True)
    kinds = ("metal", "glass")
    stem = "cycles_{}.{}".format(*bpy.app.version[:2])
    setting = f"compare_furnace.py: white flat-shaded sphere, {BOUNCES} bounces"
    rows = [row for kind in kinds for row in with_cycles(kind, args.spp, args.seeds)]
    write(os.path.join(args.out, f"{stem}_furnace.csv"),
          f"Cycles of Blender {pinned_cycles.version()}, {setting}", rows)
    for kind in kinds:
        export(scene_of(kind)[0], os.path.join(args.out, kind))
    if args.smithwalk:
        rows = [row for kind in kinds
                for row in with_smithwalk(args.smithwalk, os.path.join(args.out, kind, "scene.yaml"),
                                          kind, args.spp * args.seeds)]
        write(os.path.join(args.out, "smithwalk_furnace.csv"), f"smithwalk, {setting}", rows)
    return 0


if __name__ == "__main__":
    pinned_cycles.run(main)
