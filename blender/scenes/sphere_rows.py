"""Builds sphere_rows.blend: conductor, dielectric and diffuse spheres over roughness.

    blender -b --factory-startup --python blender/scenes/sphere_rows.py -- sphere_rows.blend
"""

import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

import common  # noqa: E402

ROUGHNESSES = (0.2, 0.4, 0.6, 0.8, 1.0)


def build():
    """480 × 320: three rows, roughness 0.2 … 1 from left to right; the diffuse row has none."""
    scene = common.empty_scene(480, 320, spp=128, note=(
        "Spheres of copper (top), glass (middle) and Lambert diffuse (bottom); roughness 0.2, 0.4,\n"
        "0.6, 0.8, 1 from left to right, grey 0.2 … 1 in the bottom row."))
    ball = common.sphere("Ball", (0.0, 0.0, 0.0), radius=0.45, segments=48, rings=24)
    mesh = ball.data
    mesh.materials.append(None)
    common.bpy.data.objects.remove(ball)
    for i, r in enumerate(ROUGHNESSES):
        row = (common.conductor(f"Copper{i + 1}", (0.93, 0.58, 0.41), r),
               common.glass(f"Glass{i + 1}", r),
               common.diffuse(f"Grey{i + 1}", (r, r, r)))
        for j, mat in enumerate(row):
            ob = common.bpy.data.objects.new(mat.name, mesh)
            ob.location = (i - 2.0, 0.0, 2.6 - j)
            scene.collection.objects.link(ob)
            ob.material_slots[0].link = "OBJECT"
            ob.material_slots[0].material = mat
    wall = common.plane("Wall", 30.0, location=(0.0, 1.5, 0.0))
    wall.rotation_euler.x = 1.5707963
    wall.data.materials.append(common.diffuse("Wall", (0.35, 0.37, 0.4)))
    ground = common.plane("Ground", 30.0)
    ground.data.materials.append(common.diffuse("Ground", (0.35, 0.37, 0.4)))
    common.constant_world(scene, (0.6, 0.7, 0.8), 0.6)
    common.area_light(scene, "Key", (-3.5, -4.0, 5.0), (0.0, 0.0, 1.6), (2.0, 2.0), 400.0, (1.0, 0.95, 0.88))
    common.camera(scene, (0.0, -9.0, 2.0), (0.0, 0.0, 1.62), 32.0)


if __name__ == "__main__":
    common.main(build)
