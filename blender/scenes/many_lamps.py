"""Builds many_lamps.blend: a terrace at night under strings of small lamps.

    PYTHONPATH=<bpy> python3 blender/scenes/many_lamps.py many_lamps.blend

Two hundred and four point lamps of 3 cm in four colours, under shades on wires
between posts; the camera does not see the lamps themselves, as Blender has it for
new ones.
"""

import math
import os
import sys

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

import bpy  # noqa: E402
import common  # noqa: E402

COLORS = ((1.0, 0.72, 0.40), (1.0, 0.72, 0.40), (1.0, 0.35, 0.22), (0.45, 0.75, 1.0), (0.55, 1.0, 0.50))
STRINGS, LAMPS, WATTS = 6, 34, 4.0  # each
HALF, TOP, SAG = 4.0, 2.9, 0.75


def strings(scene):
    """Lamps on hanging wires from side to side."""
    lamps = []
    for color in dict.fromkeys(COLORS):
        lamp = bpy.data.lights.new("Lamp", "POINT")
        lamp.energy, lamp.shadow_soft_size, lamp.color = WATTS, 0.03, color
        if hasattr(lamp, "use_soft_falloff"):
            lamp.use_soft_falloff = False  # what the user interface sets on a new light
        lamps.append(lamp)
    shades = list(dict.fromkeys(COLORS))
    wire = common.principled("Wire", (0.02, 0.02, 0.02))
    ring = [(math.cos(math.pi * k / 8), math.sin(math.pi * k / 8)) for k in range(16)]
    shade = common.mesh("Shade", [(r * x, r * y, z) for r, z in ((0.02, 0.05), (0.07, 0.0)) for x, y in ring],
                        [tuple(range(16)), *((k, (k + 1) % 16, 16 + (k + 1) % 16, 16 + k) for k in range(16))],
                        common.principled("Enamel", (0.03, 0.05, 0.04), 0.3))
    bpy.data.objects.remove(shade)
    for row in range(STRINGS):
        y = -2.4 + 6.6 * row / (STRINGS - 1)
        points = []
        for index in range(LAMPS):
            t = (index + 0.5) / LAMPS * 2.0 - 1.0
            points.append((HALF * t, y, TOP - SAG * (1.0 - t * t)))
            color = COLORS[(index * 3 + row * 2) % len(COLORS)]
            ob = bpy.data.objects.new("Lamp", lamps[shades.index(color)])
            ob.location = (points[-1][0], y, points[-1][2] - 0.07)
            ob.visible_camera = False
            scene.collection.objects.link(ob)
            cover = bpy.data.objects.new("Shade", bpy.data.meshes["Shade"])
            cover.location = (points[-1][0], y, points[-1][2] - 0.05)
            scene.collection.objects.link(cover)
        points = [(-HALF, y, TOP), *points, (HALF, y, TOP)]
        ring = ((0.0, 0.008), (-0.007, -0.004), (0.007, -0.004))
        vertices = [(x, y + dy, z + dz) for x, y, z in points for dy, dz in ring]
        faces = [(3 * k + a, 3 * k + b, 3 * k + 3 + b, 3 * k + 3 + a)
                 for k in range(len(points) - 1) for a, b in ((0, 1), (1, 2), (2, 0))]
        common.mesh(f"Wire{row + 1}", vertices, faces, wire)
        for side in (-HALF, HALF):
            common.turned(f"Post{row + 1}{'L' if side < 0 else 'R'}", (side, y, 0.0),
                          common.rounded(0.05, TOP + 0.1, 0.01, 2), bpy.data.materials["Iron"], segments=16)


def table(number, place, top, cloth):
    """A round table with two stools, and what stands on it."""
    x, y = place
    common.turned(f"Table{number}", (x, y, 0.70), common.rounded(0.55, 0.05, 0.02), top)
    common.turned(f"Leg{number}", (x, y, 0.0), common.rounded(0.05, 0.69, 0.005, 2), bpy.data.materials["Iron"],
                  segments=16)
    for index, turn in enumerate((0.6 + number, 0.6 + number + math.pi)):
        common.turned(f"Stool{number}{index + 1}", (x + 0.85 * math.cos(turn), y + 0.85 * math.sin(turn), 0.0),
                      common.rounded(0.22, 0.45, 0.06), cloth, segments=32)


def build():
    """320 × 240, 64 spp, 12 bounces."""
    scene = common.empty_scene(320, 240, note=(
        "A terrace at night: 204 small lamps under shades on strings over stone, wood, rough metals, plastic and\n"
        "a ball of rough glass."))
    scene.view_settings.view_transform = "Standard"
    common.principled("Iron", (0.35, 0.34, 0.33), 0.45, 1.0)
    strings(scene)
    floor = common.plane("Floor", 24.0)
    floor.data.materials.append(common.principled("Stone", (0.30, 0.27, 0.24), 0.35))
    common.box("House", (0.0, 5.2, 1.6), (10.0, 0.3, 3.2)).data.materials.append(
        common.diffuse("Plaster", (0.62, 0.52, 0.42)))
    common.box("Door", (-1.6, 5.03, 1.05), (1.0, 0.06, 2.1), bevel=0.02).data.materials.append(
        common.principled("Door", (0.08, 0.22, 0.20), 0.3))
    for index, x in enumerate((0.6, 2.4)):
        common.box(f"Window{index + 1}", (x, 5.03, 1.5), (1.0, 0.04, 1.1)).data.materials.append(
            bpy.data.materials.get("Dark") or common.principled("Dark", (0.015, 0.018, 0.025), 0.08))
    wood = common.principled("Wood", (0.38, 0.21, 0.10), 0.45)
    table(1, (-1.7, 0.4), wood, common.principled("Red", (0.55, 0.05, 0.04), 0.5))
    table(2, (1.6, 1.4), common.principled("White", (0.75, 0.74, 0.70), 0.3),
          common.diffuse("Canvas", (0.55, 0.50, 0.38)))
    common.sphere("Gold", (-1.9, 0.3, 0.93), radius=0.18, segments=32, rings=16).data.materials.append(
        common.conductor("Gold", (1.0, 0.71, 0.29), 0.6))
    common.sphere("Glass", (-1.45, 0.5, 0.90), radius=0.15, segments=32, rings=16).data.materials.append(
        common.glass("RoughGlass", 0.2))
    jug = [(0.0, 0.0), (0.09, 0.0), (0.15, 0.08), (0.16, 0.18), (0.11, 0.28), (0.09, 0.36), (0.12, 0.42), (0.10, 0.42),
           (0.07, 0.36), (0.0, 0.34)]
    common.turned("Jug", (1.5, 1.3, 0.75), jug, common.conductor("Copper", (0.93, 0.58, 0.41), 0.35), segments=32)
    pot = [(0.0, 0.0), (0.28, 0.0), (0.32, 0.03), (0.42, 0.55), (0.46, 0.57), (0.46, 0.65), (0.40, 0.65), (0.36, 0.58),
           (0.0, 0.56)]
    rng = np.random.default_rng(23)
    leaf = common.principled("Leaf", (0.06, 0.20, 0.05), 0.4)
    for index, x in enumerate((-3.2, 3.2)):
        common.turned(f"Pot{index + 1}", (x, 3.6, 0.0), pot, bpy.data.materials.get("Clay") or common.diffuse(
            "Clay", (0.45, 0.18, 0.10)), segments=32)
        corners, faces = [], []
        for _ in range(140):
            centre = rng.standard_normal(3) * np.array([0.28, 0.28, 0.3]) + np.array([x, 3.6, 1.15])
            one, two = rng.standard_normal((2, 3))
            one, two = 0.13 * one / np.linalg.norm(one), 0.05 * two / np.linalg.norm(two)
            faces.append(tuple(range(len(corners), len(corners) + 4)))
            corners += [tuple(centre + d) for d in (-one, two, one, -two)]
        common.mesh(f"Bush{index + 1}", corners, faces, leaf)
    common.constant_world(scene, (0.02, 0.03, 0.07), 0.5)
    common.camera(scene, (0.3, -5.6, 1.9), (0.0, 1.5, 1.05), 52.0)


if __name__ == "__main__":
    common.main(build)
