"""Cycles as a measuring instrument: pinned settings, pixels as arrays.

Shared by render_cycles.py and the measure_*.py scripts. Works in Blender 3.4
(Debian's numpy) and with the bpy 4.5 and 5.0 modules. Colours are
scene-linear Rec. 709; arrays are (height, width, 3) float32, row 0 on top.
"""

import os
import resource
import sys
import tempfile
import traceback

import bpy
import numpy as np


def script_args(argv):
    """Arguments after `--` in Blender, all of them with the bpy module."""
    if bpy.app.binary_path:
        return argv[argv.index("--") + 1:] if "--" in argv else []
    return argv[1:]


def run(main):
    """Call `main(args)` and leave with its code: 1 after an exception, which
    `blender -b` would turn into 0. Interpreter shutdown with the bpy module
    can hang, hence `os._exit`."""
    try:
        code = main(script_args(sys.argv)) or 0
    except SystemExit as stop:  # argparse
        code = stop.code if isinstance(stop.code, int) else 1
    except Exception:
        traceback.print_exc()
        code = 1
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


def version():
    """Blender's version, e.g. "3.4.1"."""
    return ".".join(str(n) for n in bpy.app.version)


def _set(owner, **values):
    """Set the properties that this version has."""
    for name, value in values.items():
        if hasattr(owner, name):
            setattr(owner, name, value)


def pin(scene, spp, seed=0, bounces=None, box_filter=True):
    """Make Cycles unbiased and comparable.

    Off: adaptive sampling, denoising, clamping, filter glossy, light
    threshold, light tree, path guiding, dithering, compositing, auto tiles.
    Caustics on, bounces equal for all kinds (None: the scene's maximum),
    opaque film, film exposure 1, one-pixel box filter unless told otherwise.
    """
    render, cycles = scene.render, scene.cycles
    render.engine = "CYCLES"
    limit = cycles.max_bounces if bounces is None else bounces
    _set(cycles, device="CPU", samples=spp, seed=seed, use_animated_seed=False,
         use_adaptive_sampling=False, use_denoising=False, sample_clamp_direct=0.0,
         sample_clamp_indirect=0.0, blur_glossy=0.0, light_sampling_threshold=0.0,
         use_light_tree=False, use_guiding=False, use_auto_tile=False, time_limit=0.0,
         sample_offset=0, use_fast_gi=False, film_exposure=1.0,
         caustics_reflective=True, caustics_refractive=True,
         max_bounces=limit, diffuse_bounces=limit, glossy_bounces=limit,
         transmission_bounces=limit, transparent_max_bounces=max(limit, 8),
         min_light_bounces=0, min_transparent_bounces=0)
    if box_filter:
        cycles.pixel_filter_type = "BOX"
    _set(render, dither_intensity=0.0, use_compositing=False, use_sequencer=False,
         use_border=False, use_motion_blur=False, film_transparent=False,
         use_persistent_data=False, use_stamp=False)
    for layer in scene.view_layers:
        layer.samples = 0


def exr_settings(scene, half=False):
    """Scene-linear RGB EXR, ZIP compressed, 32-bit floats or halves."""
    settings = scene.render.image_settings
    _set(settings, media_type="IMAGE")  # 5.0: before the format
    settings.file_format = "OPEN_EXR"
    settings.color_mode = "RGB"
    settings.color_depth = "16" if half else "32"
    settings.exr_codec = "ZIP"


def render_array(scene):
    """Render; returns the pixels and the CPU seconds (user + system, all threads,
    scene preparation included)."""
    exr_settings(scene)
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "render.exr")
        scene.render.use_file_extension = False
        scene.render.filepath = path
        before = resource.getrusage(resource.RUSAGE_SELF)
        bpy.ops.render.render(write_still=True, scene=scene.name)
        after = resource.getrusage(resource.RUSAGE_SELF)
        pixels = read_exr(path)
    cpu = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
    return pixels, cpu


def read_exr(path):
    """An EXR's colour channels as they are."""
    image = bpy.data.images.load(path)
    try:
        # 3.4 says Linear, 4.x Linear Rec.709; Raw or Non-Color convert nothing.
        image.colorspace_settings.name = "Non-Color"
        width, height = image.size
        flat = np.empty(width * height * image.channels, dtype=np.float32)
        image.pixels.foreach_get(flat)
        return flat.reshape(height, width, image.channels)[::-1, :, :3].copy()
    finally:
        bpy.data.images.remove(image)


def write_exr(scene, path, pixels, half=False):
    """Write an array as a scene-linear EXR."""
    height, width, _ = pixels.shape
    image = bpy.data.images.new("out", width, height, alpha=False, float_buffer=True)
    try:
        image.colorspace_settings.name = "Non-Color"
        rgba = np.ones((height, width, 4), dtype=np.float32)
        rgba[:, :, :3] = pixels[::-1]
        image.pixels.foreach_set(rgba.ravel())
        exr_settings(scene, half)
        image.save_render(os.path.abspath(path), scene=scene)
    finally:
        bpy.data.images.remove(image)


def robust_mean(stack):
    """Mean over seeds with fireflies left out; returns it and how many values were.

    `stack` is (seeds, height, width, 3). A value is left out when it is more
    than half as large again as its pixel's median over the seeds and lies ten
    standard deviations above it. The deviation is the median absolute one
    (× 1.4826), then the median of that over the 5 × 5 neighbourhood, since a
    few seeds alone estimate it badly. The first condition spares the pixels on
    edges, which are noisier than their neighbours.
    """
    median = np.median(stack, axis=0)
    spread = 1.4826 * np.median(np.abs(stack - median), axis=0)
    padded = np.pad(spread, ((2, 2), (2, 2), (0, 0)), mode="reflect")
    height, width, _ = spread.shape
    window = np.stack([padded[y:y + height, x:x + width] for y in range(5) for x in range(5)])
    sigma = np.median(window, axis=0)
    keep = (stack <= 1.5 * median) | (stack <= median + 10.0 * sigma)
    count = keep.sum(axis=0)
    mean = np.where(keep, stack, 0.0).sum(axis=0) / np.maximum(count, 1)
    return mean.astype(np.float32), int((~keep).sum())
