"""Builds brushed_metal.blend: engine-turned and brushed metal in a studio.

    blender -b --factory-startup --python blender/scenes/brushed_metal.py -- brushed_metal.blend

Roughness, anisotropy and its rotation come from textures, which are computed
here and packed into the .blend, as is the environment (see studio.py).
"""

import math
import os
import sys

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

import bpy  # noqa: E402
import common  # noqa: E402
from studio import image, smoothstep, studio_world  # noqa: E402


def grey(values):
    """One value for all three channels."""
    return np.repeat(np.clip(values, 0.0, 1.0)[:, :, None], 3, axis=2)


def engine_turning(size=256, count=4):
    """Overlapping polished disks: (roughness, anisotropy, rotation in turns), periodic.

    The grooves of a disk run round its centre: rotation is the angle of the
    tangent there. Rows are laid from bottom to top, each disk over those before.
    """
    y, x = (np.mgrid[0:size, 0:size] + 0.5) / size * count
    y = count - y  # up, as v
    rotation, radius = np.zeros((size, size)), np.full((size, size), 2.0)
    reach = 0.66  # of a disk, in units of their distance
    for row in range(-1, count + 2):
        for column in range(-1, count + 2):
            dx, dy = x - (column + 0.5 * (row % 2)), y - row
            distance = np.hypot(dx, dy) / reach
            over = distance < 1.0
            radius = np.where(over, distance, radius)
            rotation = np.where(over, np.arctan2(dy, dx) / (2.0 * math.pi) + 0.25, rotation)
    fine = np.random.default_rng(3).uniform(-1.0, 1.0, 64)
    groove = np.interp(radius * 63.0, np.arange(64), fine)
    rough = 0.34 + 0.05 * groove + 0.06 * radius
    # No direction at the very centre; deepest grooves half way out.
    anisotropy = 0.85 * smoothstep(radius / 0.15)
    return grey(rough), grey(anisotropy), grey(rotation % 1.0)


def brushing(size=256):
    """Streaks along u in three bands of v: (roughness, anisotropy)."""
    rng = np.random.default_rng(5)
    rows = rng.standard_normal((size, 1)) @ np.ones((1, size))
    spectrum = np.fft.fft2(rng.standard_normal((size, size)))
    fu, fv = np.meshgrid(np.fft.fftfreq(size) * size, np.fft.fftfreq(size) * size)
    streaks = np.fft.ifft2(spectrum * np.exp(-(fu / 3.0) ** 2 - (fv / 90.0) ** 2)).real
    wear = 0.5 * rows / rows.std() + streaks / streaks.std()
    v = (np.mgrid[0:size, 0:size][0] + 0.5) / size
    band = smoothstep((np.cos(6.0 * math.pi * v) + 0.6) / 0.3)  # 1: brushed, 0: blasted
    rough = np.where(band > 0.0, 0.38 + 0.05 * wear, 0.0) * band + 0.7 * (1.0 - band)
    return grey(rough), grey(0.9 * band)


def metal(name, color, roughness, anisotropy, rotation=None, repeat=1.0):
    """Multiscatter GGX with textures, its tangent along u."""
    mat, node = common.material(name, "ShaderNodeBsdfAnisotropic", Color=color)
    node.distribution = "MULTI_GGX"
    tree = mat.node_tree
    tangent = tree.nodes.new("ShaderNodeTangent")
    tangent.direction_type, tangent.uv_map = "UV_MAP", "UVMap"
    tree.links.new(tangent.outputs[0], node.inputs["Tangent"])
    coordinates = tree.nodes.new("ShaderNodeTexCoord")
    mapping = tree.nodes.new("ShaderNodeMapping")
    mapping.inputs["Scale"].default_value = (repeat, repeat, 1.0)
    tree.links.new(coordinates.outputs["UV"], mapping.inputs["Vector"])
    for key, img in (("Roughness", roughness), ("Anisotropy", anisotropy), ("Rotation", rotation)):
        if img is None:
            continue
        lookup = tree.nodes.new("ShaderNodeTexImage")
        lookup.image = img
        if key == "Rotation":
            lookup.interpolation = "Closest"  # between 0.99 and 0.01 lies no angle
        tree.links.new(mapping.outputs[0], lookup.inputs[0])
        tree.links.new(lookup.outputs["Color"], node.inputs[key])
    return mat


def build():
    """256 × 256, 64 spp, 12 bounces."""
    scene = common.empty_scene(256, 256, note=(
        "Engine-turned steel, brushed gold and copper: textures on roughness, anisotropy and its\n"
        "rotation, in the light of an environment map."))
    turned = [image(f"turned_{name}", pixels)
              for name, pixels in zip(("roughness", "anisotropy", "rotation"), engine_turning())]
    brushed = [image(f"brushed_{name}", pixels)
               for name, pixels in zip(("roughness", "anisotropy"), brushing())]

    sheet = common.plane("Sheet", 8.0)
    sheet.data.materials.append(metal("Steel", (0.72, 0.72, 0.72), *turned, repeat=3.0))
    ball = common.sphere("Ball", (-0.8, 0.1, 0.75), radius=0.75, segments=48, rings=24)
    ball.rotation_euler = (math.radians(25.0), math.radians(15.0), 0.0)
    ball.data.materials.append(metal("Gold", (1.0, 0.71, 0.29), *brushed))
    bpy.ops.mesh.primitive_torus_add(major_radius=0.5, minor_radius=0.22, major_segments=64,
                                     minor_segments=24, location=(0.85, -0.5, 0.22))
    ring = common.smooth(bpy.context.object)
    ring.name = ring.data.name = "Ring"
    ring.data.materials.append(metal("Copper", (0.93, 0.58, 0.41), *brushed, repeat=2.0))
    studio_world(scene)
    common.camera(scene, (0.0, -5.5, 2.7), (0.0, 0.0, 0.45), 36.0)


if __name__ == "__main__":
    common.main(build)
