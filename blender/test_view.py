"""PNG files of smithwalk against Blender's own, for the view transforms of this Blender.

    blender -b --factory-startup --python blender/test_view.py -- SMITHWALK
    PYTHONPATH=<bpy> python3 blender/test_view.py SMITHWALK

A panorama of colours from 2⁻¹⁰ to 2⁵ is exported and rendered to EXR and PNG;
Blender saves the EXR's pixels itself. Exits with 1 where the two PNGs differ by
more than 1 of 255 on average.
"""

import os
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "scenes"))

import bpy  # noqa: E402
import common  # noqa: E402
import numpy as np  # noqa: E402
import pinned_cycles  # noqa: E402
from smithwalk_export import exr, view  # noqa: E402
from smithwalk_export.scene import export  # noqa: E402

# View transform, look (a word of its name), exposure, gamma; those that a Blender has not are passed over.
CASES = (
    ("Standard", None, 0.0, 1.0),
    ("Standard", "High Contrast", 1.5, 1.0),
    ("Standard", None, 0.0, 1.5),
    ("Filmic", None, 0.0, 1.0),
    ("Filmic", "High Contrast", 0.7, 1.2),
    ("AgX", None, 0.0, 1.0),
    ("AgX", "Punchy", -1.0, 1.0),
)
BOUND = 1.0  # codes of 255


def panorama(folder):
    """Colours all round: brightness by latitude, hue by longitude, and a band of greys."""
    height, width = 128, 256
    image = bpy.data.images.new("panorama", width, height, float_buffer=True)
    rng = np.random.default_rng(1)
    rgba = np.ones((height, width, 4), dtype=np.float32)
    stops = np.linspace(-10.0, 5.0, height)[:, None, None]
    rgba[..., :3] = np.exp2(stops + rng.normal(0.0, 1.0, (height // 8, width // 8, 3)).repeat(8, 0).repeat(8, 1))
    rgba[:, :32, :3] = np.exp2(stops)
    image.pixels.foreach_set(rgba.ravel())
    image.filepath_raw, image.file_format = os.path.join(folder, "panorama.exr"), "OPEN_EXR"
    image.save()
    return image


def pixels(path):
    """The codes of a PNG."""
    image = bpy.data.images.load(path)
    image.colorspace_settings.name = "Non-Color"
    values = np.empty(image.size[0] * image.size[1] * image.channels, dtype=np.float32)
    image.pixels.foreach_get(values)
    values = values.reshape(image.size[1], image.size[0], -1)[::-1, :, :3] * 255.0
    bpy.data.images.remove(image)
    return values


def difference(program, folder, transform, look, exposure, gamma):
    """The mean difference in codes of 255, or None where this Blender has no such view."""
    scene = common.empty_scene(128, 64, spp=1)
    settings = scene.view_settings
    try:
        settings.view_transform = transform
        settings.look = "None" if look is None else next(
            n for n in (look, f"AgX - {look}", f"{transform} - {look}") if _has_look(settings, n))
    except (TypeError, StopIteration):
        return None
    settings.exposure, settings.gamma = exposure, gamma
    common.camera(scene, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 150.0)
    common.constant_world(scene, (1.0, 1.0, 1.0), 1.0)
    tree = scene.world.node_tree
    texture = tree.nodes.new("ShaderNodeTexEnvironment")
    texture.image = panorama(folder)
    background = next(n for n in tree.nodes if n.type == "BACKGROUND")
    tree.links.new(texture.outputs[0], background.inputs["Color"])
    log = export(scene, os.path.join(folder, "scene"))
    outputs = [os.path.join(folder, f"ours.{kind}") for kind in ("exr", "png")]
    subprocess.run([program, "render", log.path, *(a for o in outputs for a in ("-o", o))], check=True,
                   capture_output=True)
    linear = exr.read(outputs[0])["Combined"][..., :3]
    theirs = view.saved(scene, linear[::-1])[::-1] * 255.0
    return float(np.abs(pixels(outputs[1]) - theirs).mean())


def _has_look(settings, name):
    try:
        settings.look = name
    except TypeError:
        return False
    return True


def main(args):
    """All cases; 1 when one is past the bound."""
    (program,) = args
    failed = False
    for case in CASES:
        with tempfile.TemporaryDirectory() as folder:
            found = difference(program, folder, *case)
        if found is None:
            continue
        failed |= not found <= BOUND
        print(f"{pinned_cycles.version()} {case}: {found:.3f} of 255")
    return 1 if failed else 0


if __name__ == "__main__":
    pinned_cycles.run(main)
