"""Builds suzanne.blend: Suzanne in rough gold, rough glass and brushed steel on tiles.

    blender -b --factory-startup --python blender/scenes/suzanne.py -- suzanne.blend

The environment (a studio: gradient dome and three softboxes) and the tile
textures are computed here and packed into the .blend.
"""

import math
import os
import sys
import tempfile

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

import bpy  # noqa: E402
import common  # noqa: E402
import pinned_cycles  # noqa: E402

GOLD = (1.0, 0.71, 0.29)


def image(name, rgb):
    """A packed 8-bit image of (height, width, 3) stored values 0…1, row 0 on top."""
    height, width, _ = rgb.shape
    img = bpy.data.images.new(name, width, height, alpha=False)
    img.colorspace_settings.name = "Non-Color"  # the values go in unconverted
    rgba = np.ones((height, width, 4), dtype=np.float32)
    rgba[:, :, :3] = rgb[::-1]
    img.pixels.foreach_set(rgba.ravel())
    img.update()
    img.pack()
    return img


def smoothstep(x):
    """0 below 0, 1 above 1, smooth between."""
    x = np.clip(x, 0.0, 1.0)
    return x * x * (3.0 - 2.0 * x)


def studio(width=512, height=256):
    """Equirectangular radiance: u = 0.5 − atan2(y, x)/2π, v = 0.5 + asin(z)/π."""
    v, u = np.mgrid[0:height, 0:width]
    azimuth = (0.5 - (u + 0.5) / width) * 2.0 * math.pi
    elevation = (0.5 - (v + 0.5) / height) * math.pi
    # The dome: warm horizon, cool zenith, dark floor.
    t = smoothstep(np.sin(elevation))[:, :, None]
    sky = (1.0 - t) * np.array([0.22, 0.20, 0.19]) + t * np.array([0.07, 0.10, 0.16])
    floor = np.array([0.05, 0.045, 0.04])
    above = smoothstep(elevation / 0.15 + 0.5)[:, :, None]
    radiance = above * sky + (1.0 - above) * floor
    # Softboxes: azimuth and elevation of the centre, half sizes (degrees), radiance.
    for az, el, half_az, half_el, rgb in (
        (-165.0, 40.0, 16.0, 14.0, (15.0, 13.8, 12.0)),  # key, left of the camera
        (-20.0, 25.0, 8.0, 20.0, (3.0, 4.0, 5.5)),       # fill, cool, right
        (80.0, 35.0, 35.0, 6.0, (6.0, 5.8, 5.4)),        # strip behind
    ):
        turn = np.degrees(np.angle(np.exp(1j * (azimuth - math.radians(az)))))
        rise = np.degrees(elevation) - el
        edge = 2.0  # degrees over which a softbox fades out
        inside = (smoothstep((half_az - np.abs(turn)) / edge)
                  * smoothstep((half_el - np.abs(rise)) / edge))[:, :, None]
        radiance = radiance * (1.0 - inside) + inside * np.array(rgb)
    return radiance


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


def environment_image(scene):
    """The studio as a packed EXR of halves, which compresses to a small file."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "studio.exr")
        pinned_cycles.write_exr(scene, path, studio().astype(np.float32), half=True)
        img = bpy.data.images.load(path)
        img.pack()
    return img


def studio_world(scene):
    """The studio as an environment texture, turned by a Mapping node."""
    common.constant_world(scene, (0.0, 0.0, 0.0), 1.0)
    tree = scene.world.node_tree
    background = next(n for n in tree.nodes if n.type == "BACKGROUND")
    lookup = tree.nodes.new("ShaderNodeTexEnvironment")
    lookup.image = environment_image(scene)
    mapping = tree.nodes.new("ShaderNodeMapping")
    mapping.inputs["Rotation"].default_value = (0.0, 0.0, math.radians(20.0))
    coordinates = tree.nodes.new("ShaderNodeTexCoord")
    tree.links.new(coordinates.outputs["Generated"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs[0], lookup.inputs[0])
    tree.links.new(lookup.outputs["Color"], background.inputs["Color"])


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
