"""Builds furnace.blend: white spheres in a white world, where nothing may show.

    blender -b --factory-startup --python blender/scenes/furnace.py -- furnace.blend
"""

import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

import common  # noqa: E402


def build():
    """192 × 128, 1024 bounces: conductor, glass and Lambert, the rough ones at 0.3, 0.6, 1."""
    scene = common.empty_scene(192, 128, spp=256, bounces=1024, note=(
        "A white furnace: white conductors (top), glass (middle) and a Lambert sphere (bottom) in a\n"
        "world of radiance 0.5. Without a loss of energy the image is 0.5 everywhere."))
    ball = common.sphere("Ball", (0.0, 0.0, 0.0), radius=0.45)
    mesh = ball.data
    mesh.materials.append(None)
    common.bpy.data.objects.remove(ball)
    white = (1.0, 1.0, 1.0)
    rows = [[common.conductor(f"Metal{r}", white, r) for r in (0.3, 0.6, 1.0)],
            [common.glass(f"Glass{r}", r) for r in (0.3, 0.6, 1.0)],
            [common.diffuse("Lambert", white)]]
    for j, row in enumerate(rows):
        for i, mat in enumerate(row):
            ob = common.bpy.data.objects.new(mat.name, mesh)
            ob.location = (i - (len(row) - 1) / 2.0, 0.0, 1.0 - j)
            scene.collection.objects.link(ob)
            ob.material_slots[0].link = "OBJECT"
            ob.material_slots[0].material = mat
    common.constant_world(scene, white, 0.5)
    common.camera(scene, (0.0, -9.0, 0.0), (0.0, 0.0, 0.0), 28.0)


if __name__ == "__main__":
    common.main(build)
