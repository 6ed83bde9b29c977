"""CPU seconds and memory of an export, beside Blender's own OBJ exporter.

    blender -b --factory-startup --python blender/measure_speed.py -- [--side N] [--profile]
    PYTHONPATH=<bpy> python3 blender/measure_speed.py [--side N] [--profile]

A smooth, wavy grid of N × N vertices (1000: a million) with UVs, read from a file
and written once by the export and once by `wm.obj_export`. Memory is the
process's largest, Blender's own included.
"""

import argparse
import cProfile
import os
import pstats
import resource
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "scenes"))

import bpy  # noqa: E402
import common  # noqa: E402
import numpy as np  # noqa: E402
import pinned_cycles  # noqa: E402
from smithwalk_export.scene import export  # noqa: E402


def grid(side):
    """The mesh."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=side - 1, y_subdivisions=side - 1, size=2.0)
    ob = bpy.context.object
    count = len(ob.data.vertices)
    co = np.empty(count * 3, dtype=np.float32)
    ob.data.vertices.foreach_get("co", co)
    co = co.reshape(-1, 3)
    co[:, 2] = 0.05 * np.sin(17.0 * co[:, 0]) * np.cos(23.0 * co[:, 1])
    ob.data.vertices.foreach_set("co", co.ravel())
    ob.data.polygons.foreach_set("use_smooth", np.ones(len(ob.data.polygons), dtype=bool))
    ob.data.update()


def file_of(side):
    """A file that holds the grid. Made by a child: what that takes is not counted."""
    path = os.path.join(tempfile.gettempdir(), f"smithwalk_grid_{side}_{pinned_cycles.version()}.blend")
    if not os.path.exists(path):
        child = os.fork()
        if child == 0:
            common.camera(common.empty_scene(64, 64), (0.0, -6.0, 2.0), (0.0, 0.0, 0.0), 40.0)
            grid(side)
            bpy.ops.wm.save_as_mainfile(filepath=path, compress=False)
            os._exit(0)
        os.waitpid(child, 0)
    return path


def megabytes():
    """The largest resident size until now."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def main(args):
    """Measure both."""
    parser = argparse.ArgumentParser(prog="measure_speed.py")
    parser.add_argument("--side", type=int, default=1000)
    parser.add_argument("--profile", action="store_true")
    args = parser.parse_args(args)
    bpy.ops.wm.open_mainfile(filepath=file_of(args.side))
    scene = bpy.context.scene
    count = sum(len(ob.data.vertices) for ob in scene.objects if ob.type == "MESH")
    with tempfile.TemporaryDirectory() as folder:
        before = megabytes()
        begin = time.process_time()
        profile = cProfile.Profile(time.process_time)
        if args.profile:
            profile.enable()
        export(scene, folder)
        profile.disable()
        ours, peak = time.process_time() - begin, megabytes()
        begin = time.process_time()
        bpy.ops.wm.obj_export(filepath=os.path.join(folder, "theirs.obj"))
        theirs = time.process_time() - begin
        sizes = [os.path.getsize(os.path.join(folder, n)) / 1e6 for n in ("grid.obj", "theirs.obj")]
    if args.profile:
        pstats.Stats(profile).sort_stats("tottime").print_stats(14)
    print(f"{pinned_cycles.version()}: {count} vertices: export {ours:.2f} s CPU ({sizes[0]:.0f} MB), wm.obj_export "
          f"{theirs:.2f} s ({sizes[1]:.0f} MB): {ours / theirs:.2f} ×; {peak:.0f} MB at most, {before:.0f} MB before")
    return 0


if __name__ == "__main__":
    pinned_cycles.run(main)
