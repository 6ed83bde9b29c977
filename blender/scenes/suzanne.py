"""Builds suzanne.blend: Suzanne in rough gold, rough glass and brushed steel on tiles.

    blender -b --factory-startup --python blender/scenes/suzanne.py -- suzanne.blend

The environment (the studio of studio.py) and the tile
textures are computed and packed into the .blend.
"""

import math
import os
import sys

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

import bpy  # noqa: E402
import common  # noqa: E402
from studio import image, smoothstep, studio_world  # noqa: E402

GOLD = (1.0, 0.71, 0.29)


def tiles(size=512, count=4):
    """Checkered tiles with grout: (colour as sRGB values, roughness), both 0…1."""
    rng = np.random.default_rng(7)
    y, x = (np.mgrid[0:size, 0:size] + 0.5) / size * count
    i, j = x.astype(int), y.astype(int)
    checker = ((i + j) % 2)[:, :, None]
    shade = rng.uniform(-0.03, 0.03, (count, count))[j, i][:, :, None]
    dark, light = np.array([0.22, 0.25, 0.29]), np.array([0.62, 0.60, 0.56])
    color = np.where(checker == 0, dark, light) + shade
    # Periodic noise of a few octaves, for the wear of the polish.
    wear = np.zeros((size, size))
    spectrum = np.fft.fft2(rng.standard_normal((size, size)))
    frequency = np.hypot(*np.meshgrid(np.fft.fftfreq(size), np.fft.fftfreq(size)))
    frequency[0, 0] = 1.0
    wear = np.fft.ifft2(spectrum / frequency ** 1.3 * (frequency > 3.0 / size)).real
    wear = wear / wear.std()
    distance = np.minimum(np.minimum(x % 1, 1 - x % 1), np.minimum(y % 1, 1 - y % 1))
    grout = 1.0 - smoothstep((distance - 0.012) / 0.012)
    rough = np.clip(np.where(checker[:, :, 0] == 0, 0.22, 0.38) + 0.07 * wear, 0.08, 0.6)
    rough = rough * (1.0 - grout) + 0.85 * grout
    color = color * (1.0 - grout[:, :, None]) + np.array([0.36, 0.35, 0.33]) * grout[:, :, None]
    return np.clip(color, 0.0, 1.0), np.repeat(rough[:, :, None], 3, axis=2)


def floor_material():
    """Polished tiles: diffuse under a textured-roughness glossy layer of 30 %."""
    color, rough = tiles()
    mat, mix = common.material("Tiles", "ShaderNodeMixShader")
    mix.inputs[0].default_value = 0.3
    tree = mat.node_tree
    diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
    glossy = tree.nodes.new("ShaderNodeBsdfGlossy")
    glossy.distribution = "MULTI_GGX"
    glossy.inputs["Color"].default_value = (0.9, 0.9, 0.9, 1.0)
    tree.links.new(diffuse.outputs[0], mix.inputs[1])
    tree.links.new(glossy.outputs[0], mix.inputs[2])
    coordinates = tree.nodes.new("ShaderNodeTexCoord")
    mapping = tree.nodes.new("ShaderNodeMapping")
    mapping.inputs["Scale"].default_value = (10.0, 10.0, 1.0)
    mapping.inputs["Location"].default_value = (0.05, 0.1, 0.0)
    tree.links.new(coordinates.outputs["UV"], mapping.inputs["Vector"])
    for name, values, space, target in (
        ("tiles_color", color, "sRGB", diffuse.inputs["Color"]),
        ("tiles_roughness", rough, "Non-Color", glossy.inputs["Roughness"]),
    ):
        lookup = tree.nodes.new("ShaderNodeTexImage")
        lookup.image = image(name, values)
        lookup.image.colorspace_settings.name = space
        tree.links.new(mapping.outputs[0], lookup.inputs[0])
        tree.links.new(lookup.outputs["Color"], target)
    return mat


def stand(ob):
    """Lower an object on the floor, as its subdivided surface lies."""
    ob.modifiers["Subdivision"].levels = 2
    evaluated = ob.evaluated_get(bpy.context.evaluated_depsgraph_get())
    ob.location.z -= min((evaluated.matrix_world @ v.co).z for v in evaluated.data.vertices)
    ob.modifiers["Subdivision"].levels = 0  # rendered with 2; shows that the exporter heeds it


def build():
    """960 × 540, 12 bounces."""
    scene = common.empty_scene(960, 540, spp=128, note=(
        "Suzanne in rough gold, a ball of rough glass and brushed steel on polished tiles,\n"
        "lit by an environment map alone."))
    bpy.ops.mesh.primitive_monkey_add(size=2.0, location=(-0.80, 0.1, 0.80))
    suzanne = bpy.context.object
    suzanne.rotation_euler = (math.radians(-36.0), 0.0, math.radians(20.0))
    suzanne.name = suzanne.data.name = "Suzanne"
    for polygon in suzanne.data.polygons:
        polygon.use_smooth = True
    subdivision = suzanne.modifiers.new("Subdivision", "SUBSURF")
    subdivision.render_levels = 2
    suzanne.data.materials.append(common.conductor("Gold", GOLD, 0.7))
    stand(suzanne)

    ball = common.sphere("Glass", (0.95, -0.75, 0.5), radius=0.5)
    ball.data.materials.append(common.glass("RoughGlass", 0.3, ior=1.5, color=(0.95, 1.0, 0.98)))

    bpy.ops.mesh.primitive_cylinder_add(vertices=96, radius=0.55, depth=0.5, location=(1.75, 0.55, 0.25))
    drum = bpy.context.object
    drum.name = drum.data.name = "Drum"
    bevel = drum.modifiers.new("Bevel", "BEVEL")
    bevel.width, bevel.segments, bevel.limit_method = 0.05, 4, "ANGLE"
    for polygon in drum.data.polygons:
        polygon.use_smooth = len(polygon.vertices) == 4
    steel, node = common.material("BrushedSteel", "ShaderNodeBsdfAnisotropic",
                                  Color=(0.78, 0.77, 0.75), Roughness=0.45, Anisotropy=0.75)
    node.distribution = "MULTI_GGX"
    drum.data.materials.append(steel)

    ground = common.plane("Floor", 40.0)
    ground.data.materials.append(floor_material())
    studio_world(scene)
    common.camera(scene, (0.5, -8.4, 3.3), (0.2, 0.0, 0.62), 30.0)


if __name__ == "__main__":
    common.main(build)
