"""F12 without a window: stills, an animation, passes, and cancelling.

    blender -b --factory-startup --python blender/test_f12.py -- SMITHWALK
    PYTHONPATH=<bpy> python3 blender/test_f12.py SMITHWALK

What Blender saves must be, bit for bit, what the command line renders from an
export with the same options, in Combined and in every pass of the multilayer
EXR; a cancelled render must end within two seconds.
"""

import os
import signal
import subprocess
import sys
import tempfile
import threading
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "scenes"))

import bpy  # noqa: E402
import common  # noqa: E402
import numpy as np  # noqa: E402
import pinned_cycles  # noqa: E402
import smithwalk_export  # noqa: E402
from smithwalk_export import engine, exr  # noqa: E402
from smithwalk_export.scene import export  # noqa: E402

FRAMES = range(1, 4)
TO_STOP = 2.0  # seconds


def build(samples=16):
    """A gold ball that rises over a floor, 48 × 32."""
    scene = common.empty_scene(48, 32, spp=samples)
    common.camera(scene, (0.0, -6.0, 2.0), (0.0, 0.0, 0.8), 40.0)
    common.constant_world(scene, (0.5, 0.6, 0.8), 0.5)
    common.area_light(scene, "Key", (2.0, -2.0, 4.0), (0.0, 0.0, 1.0), (1.0, 1.0), 200.0)
    ball = common.sphere("Ball", (0.0, 0.0, 1.0))
    ball.data.materials.append(common.conductor("Gold", (1.0, 0.71, 0.29), 0.5))
    common.plane("Floor", 20.0).data.materials.append(common.diffuse("Grey", (0.5, 0.5, 0.5)))
    for frame, height in ((FRAMES[0], 1.0), (FRAMES[-1], 1.5)):
        ball.location.z = height
        ball.keyframe_insert("location", frame=frame)
    scene.frame_start, scene.frame_end = FRAMES[0], FRAMES[-1]
    scene.cycles.use_adaptive_sampling = False
    scene.cycles.use_denoising = False
    for _, key, _, _ in engine.PASSES:
        setattr(scene.smithwalk, f"use_{key}", True)
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "MULTI_LAYER_IMAGE"
    settings.file_format, settings.color_depth, settings.exr_codec = "OPEN_EXR_MULTILAYER", "32", "ZIP"
    if hasattr(settings, "use_exr_interleave"):  # from 5.0 on the layers are parts of their own otherwise
        settings.use_exr_interleave = True
    return scene


def by_command_line(program, scene, folder):
    """The layers of the same scene, exported and rendered outside of Blender."""
    log = export(scene, os.path.join(folder, "scene"))
    out = os.path.join(folder, "cli.exr")
    aovs = ", ".join(key for _, key, _, _ in engine.PASSES)
    command = [program, "render", log.path, "-o", out, *log.options, "-D", f"film.aovs=[{aovs}]"]
    done = subprocess.run(command, check=False, capture_output=True, text=True, env=engine.environment())
    if done.returncode and "Open Image Denoise 2" in done.stderr:  # not on this machine
        command.remove("--denoise")
        done = subprocess.run(command, check=False, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(done.stderr)
    layers = exr.read(out)
    denoised = layers.pop("denoised", None)
    if denoised is not None:
        layers["Combined"] = np.concatenate([denoised, layers["Combined"][..., 3:]], axis=-1)
    return layers


def by_blender(path):
    """The layers of a multilayer EXR that Blender saved, named as the renderer does."""
    layers = {}
    for name, pixels in exr.read_channels(path).items():
        _, layer, channel = name.rsplit(".", 2)
        layers.setdefault(layer, {})[channel] = pixels
    found = {}
    for name, key, channels, _ in (("Combined", "Combined", "RGBA", None), *engine.PASSES):
        found[key] = np.stack([layers[name][c] for c in channels], axis=-1)
    return found


def same(ours, theirs, what):
    """Whether all layers are equal bit for bit; says which is not."""
    equal = True
    for key, pixels in theirs.items():
        # Bits, for NaN and −0 are values as well.
        bits = [np.ascontiguousarray(p, dtype=np.float32).view(np.uint32) for p in (ours[key], pixels)]
        if bits[0].shape != bits[1].shape or (bits[0] != bits[1]).any():
            print(f"FAILED {what}: {key} differs")
            equal = False
    return equal


def animation(program, folder):
    """Three frames to multilayer EXR files."""
    scene = build()
    scene.render.engine = engine.ENGINE
    scene.render.filepath = os.path.join(folder, "frame_####")
    bpy.ops.render.render(animation=True)
    passed = True
    for frame in FRAMES:
        scene.frame_set(frame)
        ours = by_blender(os.path.join(folder, f"frame_{frame:04}.exr"))
        passed &= same(ours, by_command_line(program, scene, os.path.join(folder, str(frame))), f"frame {frame}")
    return passed


def still(program, folder):
    """F12, denoised, with the border of the region cropped to."""
    scene = build()
    scene.cycles.use_denoising = True
    render = scene.render
    render.engine = engine.ENGINE
    render.use_border = render.use_crop_to_border = True
    render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y = 0.25, 0.75, 0.5, 1.0
    render.filepath = os.path.join(folder, "still.exr")
    bpy.ops.render.render(write_still=True)
    return same(by_blender(render.filepath), by_command_line(program, scene, folder), "still")


def cancel():
    """How many seconds a long render takes to end after it is told to."""
    scene = build(samples=10_000_000)
    scene.render.engine = engine.ENGINE
    told = []

    def tell():
        told.append(time.monotonic())
        if bpy.app.binary_path:  # what Ctrl-C does to a Blender without a window
            os.kill(os.getpid(), signal.SIGINT)
    timer = threading.Timer(3.0, tell)
    timer.start()
    if not bpy.app.binary_path:  # the module has no such handler
        engine.SmithwalkEngine._cancelled = lambda self: bool(told)
    bpy.ops.render.render()
    timer.cancel()
    if not told:
        print("FAILED cancel: the render ended by itself")
        return float("inf")
    return time.monotonic() - told[0]


def main(args):
    """All of them; 1 when one fails."""
    (program,) = args
    os.environ["SMITHWALK"] = program
    smithwalk_export.register()
    passed = True
    for check in (animation, still):
        with tempfile.TemporaryDirectory() as folder:
            good = check(program, folder)
        print(f"{pinned_cycles.version()} {check.__name__}: {'equal bit for bit' if good else 'DIFFERS'}")
        passed &= good
    seconds = cancel()
    print(f"{pinned_cycles.version()} cancelled within {seconds:.2f} s")
    return 0 if passed and seconds <= TO_STOP else 1


if __name__ == "__main__":
    pinned_cycles.run(main)
