"""Renders jobs with Cycles; a worker of race.py.

    blender -b FILE.blend --python benches/peers/cycles_worker.py -- JOBS.json RESULTS.json DISTRIBUTION BOUNCES
    PYTHONPATH=<bpy> python3 benches/peers/cycles_worker.py FILE.blend JOBS.json RESULTS.json DISTRIBUTION BOUNCES

A job may ask for `percent` of the scene's size, `guided` (path guiding) and `denoise`
(Open Image Denoise with albedo and normal). Times are those of Blender's render
operator, less those of its hand-over of the scene to Cycles, which a render of a
few pixels tells. (A script called cycles.py would hide the add-on of that name from bpy.)
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


def render(scene, bounces, job):
    """The pixels, wall and CPU seconds."""
    pinned_cycles.pin(scene, job["spp"], job["seed"], bounces)
    scene.render.resolution_percentage = job.get("percent", 100)
    cycles = scene.cycles
    if hasattr(cycles, "use_light_tree"):
        cycles.use_light_tree = True  # as it comes
    cycles.use_guiding = job.get("guided", False)
    cycles.use_denoising = job.get("denoise", False)
    if cycles.use_denoising:
        cycles.denoiser, cycles.denoising_input_passes = "OPENIMAGEDENOISE", "RGB_ALBEDO_NORMAL"
    start = time.monotonic()
    pixels, cpu = pinned_cycles.render_array(scene)
    return pixels, time.monotonic() - start, cpu


def main(args):
    """Every job in turn."""
    if not bpy.app.binary_path:
        bpy.ops.wm.open_mainfile(filepath=os.path.abspath(args.pop(0)))
    jobs, results, distribution, bounces = args
    scene = bpy.context.scene
    override(distribution)
    with open(jobs, encoding="utf-8") as file:
        jobs = json.load(file)
    # The second time, when what is done once is done.
    before = [render(scene, int(bounces), {**jobs[0], "spp": 1, "percent": 2})[1:] for _ in range(2)][1]
    measured = []
    for job in jobs:
        pixels, wall, cpu = render(scene, int(bounces), job)
        measured.append({"wall_s": wall - before[0], "cpu_s": cpu - before[1]})
        pinned_cycles.write_exr(scene, job["out"], pixels)
    with open(results, "w", encoding="utf-8") as file:
        json.dump({"version": f"Blender {pinned_cycles.version()}", "results": measured}, file)
    return 0


pinned_cycles.run(main)
