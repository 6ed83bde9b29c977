"""The view transform: Blender's own colour management, sampled into a .cube file.

View, look, gamma, curves and any OpenColorIO configuration are in the table.
The exposure is not: the scene file has a key for it, which stays editable.
"""

import os
import tempfile

import bpy
import numpy as np

# Nodes per side: 0.07 codes of 255 off on average for AgX, 2.8 MB.
SIDE = 49
# The domain: black has a logarithm, white lies on a node, where Standard has its kink.
_OFFSET = 2.0 ** -8
_WHITE = 27          # the node of 1
_MIN = float(np.log2(_OFFSET))
_MAX = _MIN + (float(np.log2(1.0 + _OFFSET)) - _MIN) * (SIDE - 1) / _WHITE


def _settings(scene):
    """The view settings that saved images get."""
    saved = scene.render.image_settings
    if getattr(saved, "color_management", "FOLLOW_SCENE") == "OVERRIDE":
        return saved.view_settings, saved.display_settings
    return scene.view_settings, scene.display_settings


def transform(scene):
    """The name of the view transform of saved images."""
    return _settings(scene)[0].view_transform


def exposure(scene):
    """The exposure of PNG files in stops; curves come before it, so with them it is in the table."""
    view, _ = _settings(scene)
    return 0.0 if view.use_curve_mapping else view.exposure


def is_plain(scene):
    """Whether PNG files are plain sRGB, which the renderer has without a table."""
    view, display = _settings(scene)
    return (view.view_transform == "Standard" and view.look == "None" and view.gamma == 1.0
            and not view.use_curve_mapping and not getattr(view, "use_white_balance", False)
            and display.display_device == "sRGB")


def saved(scene, pixels):
    """Scene-linear pixels (height, width, 3) as `scene` saves them: display colours in [0, 1], of 16 bits."""
    height, width, _ = pixels.shape
    settings = scene.render.image_settings
    names = [n for n in ("media_type", "file_format", "color_mode", "color_depth") if hasattr(settings, n)]
    kept = {n: getattr(settings, n) for n in names}
    image = bpy.data.images.new("smithwalk view", width, height, float_buffer=True)
    back = None
    try:
        for name, value in zip(names[-3:], ("PNG", "RGB", "16")):
            if name == "file_format" and "media_type" in kept:
                settings.media_type = "IMAGE"
            setattr(settings, name, value)
        rgba = np.ones((height, width, 4), dtype=np.float32)
        rgba[..., :3] = pixels
        image.pixels.foreach_set(rgba.ravel())
        with tempfile.TemporaryDirectory(prefix="smithwalk-") as folder:
            path = os.path.join(folder, "view.png")
            image.save_render(path, scene=scene)
            back = bpy.data.images.load(path)
            back.colorspace_settings.name = "Non-Color"
            values = np.empty(back.size[0] * back.size[1] * back.channels, dtype=np.float32)
            back.pixels.foreach_get(values)
        return values.reshape(height, width, -1)[..., :3]
    finally:
        for name, value in kept.items():
            setattr(settings, name, value)
        for block in (image, back):
            if block is not None:
                bpy.data.images.remove(block)


def table(scene):
    """The table's nodes (SIDE³, 3), red fastest."""
    places = np.linspace(_MIN, _MAX, SIDE)
    linear = np.exp2(places) - _OFFSET
    linear[0], linear[_WHITE] = 0.0, 1.0
    linear /= 2.0 ** exposure(scene)  # which Blender applies, and the renderer before the table
    r, g, b = (axis.ravel() for axis in np.meshgrid(linear, linear, linear, indexing="ij"))
    nodes = np.stack([b, g, r], axis=-1)
    return saved(scene, nodes.reshape(SIDE, SIDE * SIDE, 3)).reshape(-1, 3)


def section(nodes, files):
    """Write the table; the section for the scene file."""
    path, name = files.new("view.cube")
    with open(path, "w", encoding="ascii") as f:
        f.write(f"# Display colours of scene-linear light: log2(x + {_OFFSET:g}), {_MIN:g} to {_MAX:.9g}\n"
                f"LUT_3D_SIZE {SIDE}\n")
        f.write("%.5f %.5f %.5f\n" * len(nodes) % tuple(nodes.ravel().tolist()))
    return {"lut": name, "log2": {"offset": _OFFSET, "min": _MIN, "max": _MAX}}
