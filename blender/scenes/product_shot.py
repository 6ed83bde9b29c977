"""Builds product_shot.blend: plastic and metal goods before a backdrop, in a studio.

    PYTHONPATH=<bpy> python3 blender/scenes/product_shot.py product_shot.blend

Every material is the Principled node with a colour, a roughness and for metals
Metallic 1; the light is the image of studio.py alone.
"""

import math
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

import common  # noqa: E402
from studio import studio_world  # noqa: E402


def backdrop():
    """A sheet that lies on the floor and rises behind in a curve."""
    line = [(-7.0, 0.0), (1.0, 0.0)]
    line += [(1.0 + 1.5 * math.sin(a), 1.5 - 1.5 * math.cos(a)) for a in (math.pi * k / 24 for k in range(1, 13))]
    line.append((2.5, 7.0))
    vertices = [(x, y, z) for y, z in line for x in (-9.0, 9.0)]
    faces = [(2 * k, 2 * k + 1, 2 * k + 3, 2 * k + 2) for k in range(len(line) - 1)]
    common.smooth(common.mesh("Backdrop", vertices, faces, common.principled("Paper", (0.8, 0.8, 0.8))))


def bottle():
    """The outline of a bottle's body, 1.7 high: shoulders and a neck."""
    shoulder = [(0.17 + 0.28 * math.cos(a), 1.22 + 0.28 * math.sin(a)) for a in (math.pi * k / 16 for k in range(8))]
    foot = [(0.40 + 0.05 * math.sin(a), 0.05 - 0.05 * math.cos(a)) for a in (math.pi * k / 8 for k in range(5))]
    return [(0.0, 0.0), *foot, *shoulder, (0.16, 1.52), (0.15, 1.60), (0.0, 1.61)]


def tube():
    """The outline of a squeezed tube that stands on its cap."""
    return [(0.0, 0.0), (0.235, 0.0), (0.245, 0.02), (0.26, 0.4), (0.255, 0.8), (0.235, 1.1), (0.2, 1.25), (0.19, 1.26),
            (0.0, 1.26)]


def build():
    """320 × 240, 64 spp, 12 bounces."""
    scene = common.empty_scene(320, 240, note=(
        "A product shot: bottle, jar, tube, box and dish of Blender's Principled plastic and metal of\n"
        "several roughnesses before a backdrop, in the light of a studio's image."))
    scene.view_settings.view_transform = "Standard"
    backdrop()
    steel = common.principled("Steel", (0.77, 0.78, 0.79), 0.25, 1.0)
    gold = common.principled("Gold", (0.95, 0.70, 0.40), 0.4, 1.0)
    teal = common.principled("Teal", (0.02, 0.22, 0.24), 0.15)

    common.turned("Bottle", (-1.05, 0.35, 0.0), bottle(), common.principled("White", (0.78, 0.76, 0.70), 0.35))
    common.turned("Cap", (-1.05, 0.35, 1.62), common.rounded(0.19, 0.42, 0.03), steel)
    common.turned("Jar", (0.2, -0.35, 0.0), common.rounded(0.52, 0.46, 0.08), teal)
    common.turned("Lid", (0.2, -0.35, 0.47), common.rounded(0.54, 0.2, 0.03), gold)
    common.turned("Stand", (-0.25, 0.55, 0.0), common.rounded(0.23, 0.24, 0.02),
                  common.principled("Black", (0.02, 0.02, 0.022)))
    common.turned("Tube", (-0.25, 0.55, 0.25), tube(), common.principled("Coral", (0.75, 0.16, 0.10)))
    box = common.box("Box", (1.1, 0.55, 0.6), (0.75, 0.5, 1.2), bevel=0.02)
    box.rotation_euler.z = math.radians(-24.0)
    box.data.materials.append(common.principled("Card", (0.12, 0.16, 0.32), 0.7))
    dish = [(0.0, 0.0), (0.3, 0.0), (0.34, 0.01), (0.5, 0.16), (0.56, 0.26), (0.55, 0.27), (0.53, 0.26), (0.46, 0.17),
            (0.31, 0.05), (0.0, 0.04)]
    common.turned("Dish", (1.35, -0.7, 0.0), dish, common.principled("Copper", (0.93, 0.52, 0.36), 0.55, 1.0))
    for name, place, mat in (("Pearl1", (1.25, -0.75, 0.19), teal), ("Pearl2", (1.5, -0.62, 0.21), steel)):
        common.sphere(name, place, radius=0.14, segments=32, rings=16).data.materials.append(mat)
    common.sphere("Ball", (-0.75, -0.75, 0.2), radius=0.2, segments=32, rings=16).data.materials.append(steel)
    studio_world(scene)
    common.camera(scene, (0.1, -6.6, 2.2), (0.12, 0.0, 0.93), 33.0)


if __name__ == "__main__":
    common.main(build)
