"""Renders jobs with Cycles; a worker of race.py.

    blender -b FILE.blend --python benches/peers/cycles_worker.py -- JOBS.json RESULTS.json DISTRIBUTION BOUNCES
    PYTHONPATH=<bpy> python3 benches/peers/cycles_worker.py FILE.blend JOBS.json RESULTS.json DISTRIBUTION BOUNCES

Times are those of Blender's render operator, which includes the hand-over of
the scene to Cycles and its BVH: a few hundredths of a second here. (A script
called cycles.py would hide the add-on of that name from bpy.)
"""

import json
import os
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "..", "blender"))

import bpy  # noqa: E402
import pinned_cycles  # noqa: E402
from render_cycles import override  # noqa: E402


def main(args):
    """Every job in turn."""
    if not bpy.app.binary_path:
        bpy.ops.wm.open_mainfile(filepath=os.path.abspath(args.pop(0)))
    jobs, results, distribution, bounces = args
    scene = bpy.context.scene
    override(distribution)
    with open(jobs, encoding="utf-8") as file:
        jobs = json.load(file)
    measured = []
    for job in jobs:
        pinned_cycles.pin(scene, job["spp"], job["seed"], int(bounces))
        start = time.monotonic()
        pixels, cpu = pinned_cycles.render_array(scene)
        measured.append({"wall_s": time.monotonic() - start, "cpu_s": cpu})
        pinned_cycles.write_exr(scene, job["out"], pixels)
    with open(results, "w", encoding="utf-8") as file:
        json.dump({"version": f"Blender {pinned_cycles.version()}", "results": measured}, file)
    return 0


pinned_cycles.run(main)
