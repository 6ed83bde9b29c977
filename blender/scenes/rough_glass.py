"""Builds rough_glass.blend: glass solids of several roughnesses before coloured bars.

    blender -b --factory-startup --python blender/scenes/rough_glass.py -- rough_glass.blend
"""

import math
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

import bpy  # noqa: E402
import common  # noqa: E402


def build():
    """256 × 256, 64 spp, 12 bounces."""
    scene = common.empty_scene(256, 256, note=(
        "Glass of index 1.5 and roughness 0.15 to 1 before coloured bars, under an area light and the sky."))
    # Roughness falls from the ball at the left to the bar at the right.
    ball = common.sphere("Ball", (-0.95, 0.0, 0.55), radius=0.55, segments=48, rings=24)
    ball.data.materials.append(common.glass("Glass030", 0.3))

    bpy.ops.mesh.primitive_torus_add(major_radius=0.42, minor_radius=0.17, major_segments=48,
                                     minor_segments=20, location=(0.05, -0.75, 0.17))
    ring = common.smooth(bpy.context.object)
    ring.name = ring.data.name = "Ring"
    ring.data.materials.append(common.glass("Glass015", 0.15, color=(0.93, 0.99, 0.96)))

    block = common.box("Block", (0.25, 0.45, 0.5), (0.75, 0.75, 1.0), bevel=0.03)
    block.rotation_euler.z = math.radians(28.0)
    block.data.materials.append(common.glass("Glass050", 0.5))

    small = common.sphere("Small", (-0.6, -1.0, 0.25), radius=0.25, segments=32, rings=16)
    small.data.materials.append(common.glass("Glass100", 1.0))

    bpy.ops.mesh.primitive_monkey_add(size=1.0, location=(1.15, -0.25, 0.48))
    suzanne = common.smooth(bpy.context.object)
    suzanne.name = suzanne.data.name = "Suzanne"
    suzanne.rotation_euler = (math.radians(-30.0), 0.0, math.radians(22.0))
    suzanne.data.materials.append(common.glass("Glass070", 0.7, color=(1.0, 0.93, 0.85)))

    for i, color in enumerate(((0.7, 0.12, 0.08), (0.75, 0.5, 0.06), (0.1, 0.45, 0.2), (0.08, 0.2, 0.6))):
        bar = common.box(f"Bar{i + 1}", (1.0 * i - 1.5, 1.5, 0.75), (0.35, 0.12, 1.5))
        bar.data.materials.append(common.diffuse(f"Paint{i + 1}", color))
    ground = common.plane("Ground", 20.0)
    ground.data.materials.append(common.diffuse("Ground", (0.5, 0.5, 0.5)))
    common.constant_world(scene, (0.5, 0.6, 0.8), 0.5)
    common.area_light(scene, "Key", (-2.5, -2.0, 4.0), (0.0, 0.0, 0.5), (2.0, 2.0), 250.0,
                      (1.0, 0.95, 0.88))
    common.camera(scene, (0.0, -6.0, 2.6), (0.05, 0.0, 0.5), 32.0)


if __name__ == "__main__":
    common.main(build)
