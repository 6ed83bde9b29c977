"""Builds interior.blend: a closed room that is lit by what its ceiling reflects.

    blender -b --factory-startup --python blender/scenes/interior.py -- interior.blend
"""

import math
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

import bpy  # noqa: E402
import common  # noqa: E402

WIDTH, DEPTH, HEIGHT = 4.0, 5.0, 2.8


def room():
    """Six walls, the left one terracotta, the right one blue."""
    x, y, z = WIDTH / 2, DEPTH / 2, HEIGHT
    white = common.diffuse("Plaster", (0.76, 0.75, 0.72))
    common.quad("Floor", [(-x, -y, 0), (x, -y, 0), (x, y, 0), (-x, y, 0)],
                common.diffuse("Floorboards", (0.38, 0.3, 0.22)))
    common.quad("Ceiling", [(-x, -y, z), (-x, y, z), (x, y, z), (x, -y, z)], white)
    common.quad("Back", [(-x, y, 0), (x, y, 0), (x, y, z), (-x, y, z)], white)
    common.quad("Front", [(-x, -y, 0), (-x, -y, z), (x, -y, z), (x, -y, 0)], white)
    common.quad("Left", [(-x, -y, 0), (-x, y, 0), (-x, y, z), (-x, -y, z)],
                common.diffuse("Terracotta", (0.62, 0.25, 0.14)))
    common.quad("Right", [(x, -y, 0), (x, -y, z), (x, y, z), (x, y, 0)],
                common.diffuse("Blue", (0.18, 0.32, 0.55)))


def uplight(scene):
    """A rectangle light in an open box near the back wall, shining at the ceiling."""
    shade = common.diffuse("Shade", (0.5, 0.5, 0.5))
    y, z, length, width, rim = 2.1, 1.75, 2.2, 0.4, 0.1
    for name, location, size in (
        ("Tray", (0.0, y, z - 0.03), (length + 0.08, width + 0.08, 0.02)),
        ("Rim1", (0.0, y - width / 2 - 0.03, z - 0.02 + rim / 2), (length + 0.08, 0.02, rim)),
        ("Rim2", (0.0, y + width / 2 + 0.03, z - 0.02 + rim / 2), (length + 0.08, 0.02, rim)),
        ("Rim3", (-length / 2 - 0.03, y, z - 0.02 + rim / 2), (0.02, width + 0.04, rim)),
        ("Rim4", (length / 2 + 0.03, y, z - 0.02 + rim / 2), (0.02, width + 0.04, rim)),
    ):
        common.box(name, location, size).data.materials.append(shade)
    common.area_light(scene, "Uplight", (0.0, y, z), (0.0, y, HEIGHT), (length, width), 130.0,
                      (1.0, 0.93, 0.82))


def build():
    """256 × 256, 64 spp, 12 bounces."""
    scene = common.empty_scene(256, 256, note=(
        "A closed room: the light shines at the ceiling, all else is lit by reflections; rough metals."))
    room()
    uplight(scene)

    ball = common.sphere("Ball", (-0.95, 0.75, 0.55), radius=0.55, segments=48, rings=24)
    ball.data.materials.append(common.conductor("Gold", (1.0, 0.71, 0.29), 0.6))

    plinth = common.box("Plinth", (0.75, 1.1, 0.25), (0.9, 0.9, 0.5), bevel=0.02)
    plinth.rotation_euler.z = math.radians(20.0)
    plinth.data.materials.append(common.diffuse("Stone", (0.55, 0.53, 0.5)))
    bpy.ops.mesh.primitive_monkey_add(size=0.95, location=(0.75, 1.05, 0.93))
    suzanne = common.smooth(bpy.context.object)
    suzanne.name = suzanne.data.name = "Suzanne"
    suzanne.rotation_euler = (math.radians(-8.0), 0.0, math.radians(-12.0))
    suzanne.data.materials.append(common.conductor("Copper", (0.95, 0.6, 0.45), 0.8))

    bpy.ops.mesh.primitive_torus_add(major_radius=0.34, minor_radius=0.13, major_segments=40,
                                     minor_segments=16, location=(0.1, -0.35, 0.13))
    ring = common.smooth(bpy.context.object)
    ring.name = ring.data.name = "Ring"
    ring.data.materials.append(common.conductor("Aluminium", (0.91, 0.92, 0.92), 0.4))

    common.constant_world(scene, (0.0, 0.0, 0.0), 0.0)
    common.camera(scene, (0.0, -2.4, 1.25), (0.0, 1.0, 0.8), 55.0)


if __name__ == "__main__":
    common.main(build)
