"""Export a .blend, render it with Cycles and smithwalk, and write report.html.

    blender -b my.blend --python blender/compare.py -- OUT [--spp N] [--percent P]
    PYTHONPATH=<bpy> python3 blender/compare.py my.blend OUT [options]

Cycles renders the file's own settings, except that adaptive sampling and
denoising are off, so that whatever the export left out shows. OUT/ then holds
scene/, cycles.exr, smithwalk.exr and report.html: one file, side by side with
a slider, zoom, the difference, z-scores, and the values under the cursor. The
program is that of SMITHWALK, target/release/smithwalk, or the PATH.
"""

import argparse
import base64
import html
import json
import math
import os
import subprocess
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

try:
    import bpy
    import numpy as np
    import pinned_cycles
except ImportError as missing:
    sys.exit(f"compare.py: {missing}: run it by `blender -b FILE --python`, or with the bpy module")
from command import program  # noqa: E402
from smithwalk_export import exr  # noqa: E402
from smithwalk_export.log import APPROXIMATE, GENERAL, NOTE, WRONG  # noqa: E402
from smithwalk_export.scene import export  # noqa: E402

_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
_WITHIN = 2.5  # standard deviations that count as agreement: 98.8 % of pixels of pure noise


def render_cycles(scene, spp):
    """Two renders of half the samples; their mean and the variance of it, per pixel."""
    cycles = scene.cycles
    for name, value in (("use_adaptive_sampling", False), ("use_denoising", False), ("time_limit", 0.0),
                        ("device", "CPU"), ("use_animated_seed", False), ("samples", max(spp // 2, 1))):
        if hasattr(cycles, name):
            setattr(cycles, name, value)
    scene.render.engine = "CYCLES"
    scene.render.use_border = False
    scene.render.dither_intensity = 0.0
    for layer in scene.view_layers:
        layer.samples = 0
    images = []
    for seed in (1, 2):
        cycles.seed = seed
        images.append(pinned_cycles.render_array(scene)[0].astype(np.float64))
    mean = (images[0] + images[1]) / 2.0
    variance = smooth((((images[0] - images[1]) @ _LUMINANCE) / 2.0) ** 2)
    return mean, variance


def make_single(owners):
    """GGX instead of Multiscatter GGX in every node of every material."""
    for tree in [o.node_tree for o in owners if o.node_tree] + list(bpy.data.node_groups):
        for node in tree.nodes:
            if getattr(node, "distribution", None) == "MULTI_GGX":
                node.distribution = "GGX"


def flip(ours, theirs):
    """The mean of FLIP, by the renderer's own comparison of two files."""
    done = subprocess.run([program(), "diff", ours, theirs, "--json"], check=False, text=True, capture_output=True)
    if done.returncode:
        raise SystemExit(f"compare.py: smithwalk diff: {done.stderr.strip()}")
    return json.loads(done.stdout)["flip"]


def smooth(values):
    """The mean over 5 × 5 pixels: one difference alone says little about a variance."""
    padded = np.pad(values, 2, mode="edge")
    height, width = values.shape
    return sum(padded[y:y + height, x:x + width] for y in range(5) for x in range(5)) / 25.0


def picture(scene, pixels, path):
    """A PNG as Blender shows it: view transform, look, exposure, gamma."""
    height, width, _ = pixels.shape
    image = bpy.data.images.new("compare", width, height, float_buffer=True)
    try:
        rgba = np.ones((height, width, 4), dtype=np.float32)
        rgba[..., :3] = pixels[::-1]
        image.pixels.foreach_set(rgba.ravel())
        settings = scene.render.image_settings
        if hasattr(settings, "media_type"):
            settings.media_type = "IMAGE"
        settings.file_format, settings.color_mode, settings.color_depth = "PNG", "RGB", "8"
        image.save_render(path, scene=scene)
    finally:
        bpy.data.images.remove(image)
    return path


def colours(values, path):
    """A PNG of −1…1: blue below 0, white at 0, red above."""
    t = np.clip(values, -1.0, 1.0)[..., None]
    red, blue = np.array([0.75, 0.05, 0.05]), np.array([0.05, 0.15, 0.75])
    rgb = np.where(t > 0.0, 1.0 + t * (red - 1.0), 1.0 - t * (blue - 1.0))
    height, width = values.shape
    image = bpy.data.images.new("compare", width, height)
    try:
        rgba = np.ones((height, width, 4), dtype=np.float32)
        rgba[..., :3] = rgb[::-1]
        image.pixels.foreach_set(rgba.ravel())
        image.filepath_raw, image.file_format = path, "PNG"
        image.save()
    finally:
        bpy.data.images.remove(image)
    return path


def figures(ours, theirs, ours_variance, theirs_variance):
    """The sentence's numbers, and the z-scores."""
    difference = (ours - theirs) @ _LUMINANCE
    deviation = np.sqrt(np.maximum(ours_variance + theirs_variance, 1e-12))
    z = difference / deviation
    level = max(float((theirs @ _LUMINANCE).mean()), 1e-9)
    count = difference.size
    return {
        "bias": float(difference.mean()) / level,
        "bias_sd": math.sqrt(float((deviation ** 2).sum())) / count / level,
        "within_noise": float((np.abs(z) <= _WITHIN).mean()),
        "rmse": math.sqrt(float((difference ** 2).mean())) / level,
    }, z


def sentence(f):
    """What the figures say."""
    bound = abs(f["bias"]) + 2.0 * f["bias_sd"]
    return (f"smithwalk is {abs(100 * f['bias']):.2f} % ± {100 * f['bias_sd']:.2f} % "
            f"{'brighter' if f['bias'] > 0 else 'darker'} than Cycles on average (no bias above {100 * bound:.2f} %); "
            f"{100 * f['within_noise']:.1f} % of the pixels agree within {_WITHIN:g} standard deviations of noise "
            f"(98.8 % would by noise alone); FLIP {f['flip']:.3f}.")


def embed(path):
    """A file as a data URL."""
    with open(path, "rb") as f:
        return "data:image/png;base64," + base64.b64encode(f.read()).decode()


def floats(pixels):
    """Pixels as base64 of 32-bit floats."""
    return base64.b64encode(np.ascontiguousarray(pixels, dtype="<f4").tobytes()).decode()


def report(path, title, said, log, pictures, arrays):
    """Write the page."""
    height, width, _ = arrays["ours"].shape
    groups = []
    for grade, name in ((WRONG, "Visibly wrong"), (APPROXIMATE, "Approximate"), (GENERAL, "True of every export"),
                        (NOTE, "Mended, or left out without loss")):
        entries = log.of(grade)
        if entries:
            lines = "".join(f"<li>{html.escape(str(e))}</li>" for e in entries)
            groups.append(f"<h3>{name} ({len(entries)})</h3><ul>{lines}</ul>")
    with open(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "src", "cli", "diff", "report.html"),
              encoding="utf-8") as f:
        page = f.read()
    for key, value in {
        "TITLE": html.escape(title), "SENTENCE": html.escape(said), "WIDTH": str(width), "HEIGHT": str(height),
        "NOTES": "<h2>What the export said</h2>" + ("".join(groups) or "<p>Everything was carried.</p>"),
        "A": "smithwalk", "B": "Cycles", "FULL": "the mean brightness", "FULL_Z": "4", "Z": "",
        **{f"IMAGE_{k.upper()}": embed(p) for k, p in pictures.items()},
        **{f"FLOATS_{k.upper()}": floats(a) for k, a in arrays.items()},
    }.items():
        page = page.replace("{{" + key + "}}", value)
    with open(path, "w", encoding="utf-8") as f:
        f.write(page)


def main(args):
    """Export, render twice, compare, write."""
    parser = argparse.ArgumentParser(prog="compare.py", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    if not bpy.app.binary_path:
        parser.add_argument("blend")
    parser.add_argument("out", help="the folder to write to")
    parser.add_argument("--spp", type=int, help="samples per pixel (the scene's, at most 128)")
    parser.add_argument("--percent", type=int, help="of the resolution (the scene's)")
    parser.add_argument("--estimator", help="of smithwalk (auto)", default="auto")
    parser.add_argument("--single", action="store_true",
                        help="single-scattering GGX on both sides: the multiple scattering of Cycles is not that of smithwalk")
    args = parser.parse_args(args)
    if not bpy.app.binary_path:
        bpy.ops.wm.open_mainfile(filepath=os.path.abspath(args.blend))
    scene = bpy.context.scene
    out = os.path.abspath(args.out)
    os.makedirs(out, exist_ok=True)
    if args.percent:
        scene.render.resolution_percentage = args.percent
    spp = args.spp or min(scene.cycles.samples, 128)

    if args.single:
        make_single(bpy.data.materials)
    log = export(scene, os.path.join(out, "scene"))
    ours_path = os.path.join(out, "smithwalk.exr")
    done = subprocess.run([program(), "render", log.path, "-o", ours_path, "--spp", str(spp), "--estimator",
                           args.estimator, "-D", "film.aovs=[variance]"], check=False, text=True, capture_output=True)
    if done.returncode:
        raise SystemExit(f"compare.py: smithwalk: {done.stderr.strip()}")
    layers = exr.read(ours_path)
    ours = layers["Combined"][..., :3].astype(np.float64)
    theirs, theirs_variance = render_cycles(scene, spp)
    pinned_cycles.write_exr(scene, os.path.join(out, "cycles.exr"), theirs.astype(np.float32))
    ours_variance = smooth(layers["variance"][..., :3].astype(np.float64) @ _LUMINANCE ** 2)
    numbers, z = figures(ours, theirs, ours_variance, theirs_variance)
    numbers["flip"] = flip(ours_path, os.path.join(out, "cycles.exr"))

    level = max(float((theirs @ _LUMINANCE).mean()), 1e-9)
    pictures = {
        "ours": picture(scene, ours, os.path.join(out, "smithwalk.png")),
        "theirs": picture(scene, theirs, os.path.join(out, "cycles.png")),
        "difference": colours(((ours - theirs) @ _LUMINANCE) / level, os.path.join(out, "difference.png")),
        "z": colours(z / 4.0, os.path.join(out, "z.png")),
    }
    said = sentence(numbers)
    name = os.path.basename(bpy.data.filepath) or "scene"
    report(os.path.join(out, "report.html"), f"{name}, Blender {pinned_cycles.version()}, {spp} samples", said, log,
           pictures, {"ours": ours, "theirs": theirs})
    with open(os.path.join(out, "report.json"), "w", encoding="utf-8") as f:
        json.dump({**numbers, "wrong": len(log.of(WRONG)), "approximate": len(log.of(APPROXIMATE))}, f, indent=1)
        f.write("\n")
    print(log.summary())
    print(said)
    print(f"wrote {os.path.join(out, 'report.html')}")
    return 0


if __name__ == "__main__":
    pinned_cycles.run(main)
