"""Builds gold_sphere.blend: a rough gold sphere on a grey plane, one area light.

    blender -b --factory-startup --python blender/scenes/gold_sphere.py -- gold_sphere.blend
"""

import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

import common  # noqa: E402

GOLD = (1.0, 0.71, 0.29)


def build():
    """256 × 256, 64 spp, 12 bounces; roughness 0.8 (α = 0.64)."""
    scene = common.empty_scene(256, 256, note=(
        "A gold sphere of roughness 0.8: multiple scattering keeps it bright and saturates it."))
    ball = common.sphere("Ball", (0.0, 0.0, 1.0))
    ball.data.materials.append(common.conductor("Gold", GOLD, 0.8))
    ground = common.plane("Ground", 20.0)
    ground.data.materials.append(common.diffuse("Ground", (0.5, 0.5, 0.5)))
    common.constant_world(scene, (0.5, 0.6, 0.8), 0.5)
    common.area_light(scene, "Key", (2.5, -2.0, 4.0), (0.0, 0.0, 1.0), (1.5, 1.0), 200.0)
    common.camera(scene, (0.0, -6.0, 2.5), (0.0, 0.0, 0.9), 35.0)


if __name__ == "__main__":
    common.main(build)
