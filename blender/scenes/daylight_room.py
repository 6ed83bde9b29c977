"""Builds daylight_room.blend: a room by sun and sky through a window with panes.

    PYTHONPATH=<bpy> python3 blender/scenes/daylight_room.py daylight_room.blend

The panes are what architects' files have for them: single faces that reflect by
Fresnel's factor and else are transparent, so that light samples pass. The sky and
the floorboards are computed and packed into the .blend.
"""

import math
import os
import sys

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

import bpy  # noqa: E402
import common  # noqa: E402
from mathutils import Vector  # noqa: E402
from studio import environment_world, image, smoothstep  # noqa: E402

LEFT, RIGHT, FRONT, BACK, HEIGHT = -2.4, 2.4, -3.0, 2.6, 2.7
WINDOW = (-0.7, 1.5, 0.75, 2.25)  # along y, and z
TO_SUN = (-0.80, -0.22, 0.56)


def sky(width=256, height=128):
    """Radiance of a clear sky over pale ground, brighter around the sun, which is a lamp."""
    v, u = np.mgrid[0:height, 0:width]
    azimuth = (0.5 - (u + 0.5) / width) * 2.0 * math.pi
    elevation = (0.5 - (v + 0.5) / height) * math.pi
    direction = np.stack([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])
    near = np.clip(np.tensordot(np.array(Vector(TO_SUN).normalized()), direction, 1), 0.0, 1.0)[:, :, None]
    rise = np.clip(np.sin(elevation), 0.0, 1.0)[:, :, None] ** 0.5
    blue = (1.0 - rise) * np.array([1.9, 2.1, 2.3]) + rise * np.array([0.45, 0.8, 1.5])
    glow = 3.0 * near ** 12 * np.array([1.0, 0.92, 0.78])
    above = smoothstep(elevation / 0.06 + 0.5)[:, :, None]
    return 1.6 * (above * (blue + glow) + (1.0 - above) * np.array([0.42, 0.40, 0.34]))


def boards(size=256, count=8):
    """Floorboards along v: (colour as sRGB values, roughness), periodic."""
    rng = np.random.default_rng(17)
    y, x = (np.mgrid[0:size, 0:size] + 0.5) / size
    board = (x * count).astype(int)
    seam_at = rng.uniform(0.0, 1.0, count)[board]
    end = np.abs((y - seam_at + 0.5) % 1.0 - 0.5)
    edge = np.minimum(np.minimum(x * count % 1.0, 1.0 - x * count % 1.0) / count, end)
    spectrum = np.fft.fft2(rng.standard_normal((size, size)))
    fx, fy = np.meshgrid(np.fft.fftfreq(size) * size, np.fft.fftfreq(size) * size)
    grain = np.fft.ifft2(spectrum * np.exp(-(fx / 40.0) ** 2 - (fy / 4.0) ** 2)).real
    grain = np.clip(grain / grain.std(), -2.5, 2.5)
    shade = rng.uniform(-0.05, 0.05, count)[board] + 0.025 * grain
    seam = 1.0 - smoothstep((edge - 0.002) / 0.003)
    color = np.array([0.62, 0.45, 0.31]) + shade[:, :, None] * np.array([1.0, 0.9, 0.8])
    rough = 0.42 + 0.04 * grain + 0.3 * seam
    return color * (1.0 - 0.6 * seam[:, :, None]), np.repeat(rough[:, :, None], 3, axis=2)


def floor_material():
    """Principled with both textures."""
    mat, node = common.material("Boards", "ShaderNodeBsdfPrincipled")
    node.distribution = "MULTI_GGX"
    tree = mat.node_tree
    coordinates = tree.nodes.new("ShaderNodeTexCoord")
    mapping = tree.nodes.new("ShaderNodeMapping")
    mapping.inputs["Scale"].default_value = (4.0, 2.0, 1.0)
    tree.links.new(coordinates.outputs["UV"], mapping.inputs["Vector"])
    for key, values, space in zip(("Base Color", "Roughness"), boards(), ("sRGB", "Non-Color")):
        lookup = tree.nodes.new("ShaderNodeTexImage")
        lookup.image = image(f"boards_{key.split()[-1].lower()}", np.clip(values, 0.0, 1.0))
        lookup.image.colorspace_settings.name = space
        tree.links.new(mapping.outputs[0], lookup.inputs[0])
        tree.links.new(lookup.outputs["Color"], node.inputs[key])
    return mat


def pane_material():
    """Smooth reflection by Fresnel's factor over full transparency."""
    mat, mix = common.material("Pane", "ShaderNodeMixShader")
    tree = mat.node_tree
    fresnel = tree.nodes.new("ShaderNodeFresnel")
    fresnel.inputs["IOR"].default_value = 1.5
    clear = tree.nodes.new("ShaderNodeBsdfTransparent")
    mirror = tree.nodes.new("ShaderNodeBsdfGlossy")
    mirror.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    mirror.inputs["Roughness"].default_value = 0.0
    for output, target in zip((fresnel, clear, mirror), mix.inputs):
        tree.links.new(output.outputs[0], target)
    return mat


def room():
    """Walls, the window in the left one, its frame and four panes."""
    y0, y1, z0, z1 = WINDOW
    wall = common.principled("Wall", (0.80, 0.78, 0.74), 0.7)
    floor = common.plane("Floor", 1.0, ((LEFT + RIGHT) / 2, (FRONT + BACK) / 2, 0.0))
    floor.scale = (RIGHT - LEFT, BACK - FRONT, 1.0)
    floor.data.materials.append(floor_material())
    x, low, high = (LEFT, RIGHT), 0.0, HEIGHT
    common.quad("Ceiling", [(x[0], FRONT, high), (x[0], BACK, high), (x[1], BACK, high), (x[1], FRONT, high)],
                common.principled("Ceiling", (0.85, 0.85, 0.84), 0.8))
    for name, y in (("Back", BACK), ("Front", FRONT)):
        common.quad(name, [(x[0], y, low), (x[1], y, low), (x[1], y, high), (x[0], y, high)], wall)
    common.quad("Right", [(x[1], FRONT, low), (x[1], BACK, low), (x[1], BACK, high), (x[1], FRONT, high)],
                common.principled("Sage", (0.36, 0.45, 0.38), 0.7))
    for name, a, b, c, d in (("Below", FRONT, BACK, low, z0), ("Above", FRONT, BACK, z1, high),
                             ("Before", FRONT, y0, z0, z1), ("Behind", y1, BACK, z0, z1)):
        common.box(name, (x[0] - 0.15, (a + b) / 2, (c + d) / 2), (0.3, b - a, d - c)).data.materials.append(wall)
    frame, bar = common.principled("Frame", (0.75, 0.75, 0.73), 0.35), 0.06
    middle = ((y0 + y1) / 2, (z0 + z1) / 2)
    for index, (y, z, wide, tall) in enumerate((
            (y0 + bar / 2, middle[1], bar, z1 - z0), (y1 - bar / 2, middle[1], bar, z1 - z0), (*middle, bar, z1 - z0),
            (middle[0], z0 + bar / 2, y1 - y0, bar), (middle[0], z1 - bar / 2, y1 - y0, bar), (*middle, y1 - y0, bar))):
        common.box(f"Bar{index + 1}", (x[0] - 0.2, y, z), (0.06, wide, tall)).data.materials.append(frame)
    sill = common.box("Sill", (x[0] + 0.03, middle[0], z0 - 0.02), (0.3, y1 - y0 + 0.2, 0.04), bevel=0.01)
    sill.data.materials.append(frame)
    glass = pane_material()
    number = 1
    for c, d in ((z0, middle[1]), (middle[1], z1)):
        for a, b in ((y0, middle[0]), (middle[0], y1)):
            common.quad(f"Pane{number}", [(x[0] - 0.2, y, z) for y, z in ((a, c), (b, c), (b, d), (a, d))], glass)
            number += 1


def furniture():
    """A sofa, a table with a vase and a bowl, a picture, a lamp of steel."""
    cloth = common.principled("Cloth", (0.16, 0.26, 0.42), 0.8)
    for name, place, size in (
            ("Seat", (0.4, 1.9, 0.32), (1.9, 0.85, 0.3)), ("Rest", (0.4, 2.28, 0.62), (1.9, 0.26, 0.66)),
            ("Arm1", (-0.62, 1.9, 0.42), (0.22, 0.85, 0.5)), ("Arm2", (1.42, 1.9, 0.42), (0.22, 0.85, 0.5))):
        common.box(name, place, size, bevel=0.06).data.materials.append(cloth)
    cushion = common.box("Cushion", (-0.25, 2.02, 0.64), (0.42, 0.16, 0.4), bevel=0.07)
    cushion.rotation_euler = (math.radians(-18.0), 0.0, math.radians(12.0))
    cushion.data.materials.append(common.principled("Mustard", (0.72, 0.42, 0.07), 0.8))
    oak = common.principled("Oak", (0.42, 0.25, 0.13), 0.4)
    common.turned("Table", (0.25, 0.55, 0.42), common.rounded(0.55, 0.05, 0.02), oak)
    steel = common.principled("Steel", (0.7, 0.7, 0.72), 0.3, 1.0)
    common.turned("Column", (0.25, 0.55, 0.02), common.rounded(0.04, 0.4, 0.005), steel)
    common.turned("Foot", (0.25, 0.55, 0.0), common.rounded(0.3, 0.02, 0.008), steel)
    vase = [(0.0, 0.0), (0.06, 0.0), (0.10, 0.05), (0.12, 0.13), (0.10, 0.21), (0.05, 0.28), (0.045, 0.32), (0.06, 0.36),
            (0.05, 0.36), (0.035, 0.32), (0.0, 0.3)]
    common.turned("Vase", (0.05, 0.7, 0.47), vase, common.principled("Glaze", (0.05, 0.16, 0.30), 0.15), segments=32)
    bowl = [(0.0, 0.0), (0.06, 0.0), (0.13, 0.05), (0.17, 0.11), (0.16, 0.11), (0.12, 0.06), (0.05, 0.02), (0.0, 0.02)]
    common.turned("Bowl", (0.48, 0.4, 0.47), bowl, common.principled("Brass", (0.90, 0.66, 0.32), 0.35, 1.0), segments=32)
    common.box("Picture", (0.5, BACK - 0.03, 1.65), (0.95, 0.04, 0.65)).data.materials.append(
        common.principled("Print", (0.55, 0.20, 0.12), 0.5))
    common.turned("Pole", (1.85, 2.1, 0.0), [*common.rounded(0.16, 0.03, 0.01)[:-1], (0.015, 0.035), (0.015, 1.45),
                                             (0.0, 1.45)], steel, segments=24)
    common.turned("Shade", (1.85, 2.1, 1.4), [(0.0, 0.27), (0.12, 0.27), (0.24, 0.0), (0.0, 0.03)],
                  common.principled("Linen", (0.75, 0.68, 0.55), 0.9), segments=32)


def build():
    """320 × 240, 64 spp, 12 bounces."""
    scene = common.empty_scene(320, 240, note=(
        "A room by daylight: sun and sky come through a window with panes, whose faces reflect by\n"
        "Fresnel's factor; Principled walls, cloth, wood and metal, floorboards of textures."))
    scene.view_settings.view_transform = "Standard"
    room()
    furniture()
    sun = bpy.data.lights.new("Sun", "SUN")
    sun.energy, sun.angle, sun.color = 28.0, math.radians(1.0), (1.0, 0.92, 0.80)
    ob = bpy.data.objects.new("Sun", sun)
    ob.rotation_euler = Vector(TO_SUN).to_track_quat("Z", "Y").to_euler()
    ob.visible_camera = False  # what the user interface sets on a new light
    scene.collection.objects.link(ob)
    environment_world(scene, "sky", sky())
    common.camera(scene, (1.55, -2.6, 1.45), (-0.25, 1.5, 0.95), 62.0)


if __name__ == "__main__":
    common.main(build)
