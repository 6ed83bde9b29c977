"""Measure Cycles' conventions: parity_cases.py, exported and rendered.

    blender -b --factory-startup --python blender/measure_parity.py -- OUT_DIR [--only NAME]...
    PYTHONPATH=<bpy> python3 blender/measure_parity.py OUT_DIR [--only NAME]...

Writes for each case OUT_DIR/<case>/cycles_<major.minor>/: scene.yaml and its
files by the exporter; reference.exr, the mean over the seeds; stderr.exr, its
standard error per pixel, estimated from the seeds; and reference.json with
version, settings, mean and standard error of the mean. Scenes are made anew
in each version, so power has the units of that version. The committed data is
in tests/data/parity.
"""

import argparse
import json
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

import bpy  # noqa: E402
import numpy as np  # noqa: E402

import parity_cases  # noqa: E402
import parity_textures  # noqa: E402,F401  registers its cases
import pinned_cycles  # noqa: E402
from smithwalk_export.scene import export  # noqa: E402

SEEDS = range(1, 9)


def measure(name, folder, spp):
    """Build, export and render one case."""
    note, width, height, bounces, _, build = parity_cases.CASES[name]
    scene = parity_cases.common.empty_scene(width, height, spp=spp, bounces=bounces, note=note)
    build(scene)
    log = export(scene, folder)
    # What is said of the scene's settings, pinned_cycles takes away.
    lost = [w for w in log.warnings if not w.startswith("scene: ")]
    if lost:
        raise RuntimeError(f"{name}: a case must be carried whole: {lost}")

    images = []
    for seed in SEEDS:
        pinned_cycles.pin(scene, spp, seed)
        images.append(pinned_cycles.render_array(scene)[0].astype(np.float64))
    stack = np.stack(images)
    mean = stack.mean(axis=0)
    error = stack.std(axis=0, ddof=1) / len(stack) ** 0.5
    means = stack.mean(axis=(1, 2))
    for file, pixels in (("reference.exr", mean), ("stderr.exr", error)):
        pinned_cycles.write_exr(scene, os.path.join(folder, file), pixels.astype(np.float32))
    report = {
        "shows": note,
        "blender": pinned_cycles.version(),
        "spp": spp,
        "seeds": list(SEEDS),
        "bounces": bounces,
        "filter": "box",
        "mean": [round(float(c), 7) for c in means.mean(axis=0)],
        "stderr_of_mean": [float(f"{c:.2g}") for c in means.std(axis=0, ddof=1) / len(stack) ** 0.5],
    }
    with open(os.path.join(folder, "reference.json"), "w", encoding="utf-8") as f:
        json.dump(report, f, indent=1, ensure_ascii=False)
        f.write("\n")
    print(f"{name}: mean {report['mean']} ± {report['stderr_of_mean']}")


def main(args):
    """Measure all cases that this version has, or the named ones."""
    parser = argparse.ArgumentParser(prog="measure_parity.py")
    parser.add_argument("out")
    parser.add_argument("--only", action="append", choices=sorted(parity_cases.CASES))
    parser.add_argument("--spp", type=int, default=512, help="per seed")
    args = parser.parse_args(args)
    version = "cycles_{}.{}".format(*bpy.app.version[:2])
    for name in args.only or parity_cases.CASES:
        if bpy.app.version >= parity_cases.CASES[name][4]:
            measure(name, os.path.join(args.out, name, version), args.spp)
    return 0


if __name__ == "__main__":
    pinned_cycles.run(main)
