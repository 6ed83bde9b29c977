"""Builds spheres of Blender's Principled node under a sky with a sun, for benches/peers/race_principled.py.

    PYTHONPATH=<bpy> python3 blender/scenes/principled_spheres.py OUT_DIR SIDE

Writes NAME.blend and, by the exporter, NAME/scene.yaml for each of SPHERES, and
OUT_DIR/sky.exr; SIDE is in pixels. One thread, so that nobody's CPU time holds waiting.
"""

import math
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

import bpy  # noqa: E402
import common  # noqa: E402
import numpy as np  # noqa: E402
import pinned_cycles  # noqa: E402
from smithwalk_export.scene import export  # noqa: E402

RED = (0.5, 0.1, 0.05)
SPHERES = {
    "plastic": {"Base_Color": RED, "Roughness": 0.3},
    "coat_over_metal": {"Base_Color": (0.9, 0.6, 0.3), "Metallic": 1.0, "Roughness": 0.4, "Coat_Weight": 1.0},
    "coat_over_plastic": {"Base_Color": RED, "Roughness": 0.5, "Coat_Weight": 1.0, "Coat_Roughness": 0.1,
                          "Coat_IOR": 1.6},
}
WIDTH, HEIGHT = 256, 128


def sky(path):
    """A gradient above dark ground, and a sun of 8° across, 40° high."""
    rows, columns = (np.indices((HEIGHT, WIDTH)) + 0.5) / np.array([HEIGHT, WIDTH])[:, None, None]
    up = (rows - 0.5) * math.pi
    along = columns * 2.0 * math.pi
    pixels = np.ones((HEIGHT, WIDTH, 4), dtype=np.float32)
    rise = np.clip(np.sin(up), 0.0, 1.0)[..., None]
    pixels[..., :3] = np.where(up[..., None] < 0.0, 0.12, (0.7, 0.75, 0.8) - (0.5, 0.4, 0.1) * rise)
    sun = math.radians(40.0), math.radians(200.0)
    cos = np.sin(up) * math.sin(sun[0]) + np.cos(up) * math.cos(sun[0]) * np.cos(along - sun[1])
    pixels[cos > math.cos(math.radians(4.0)), :3] = (90.0, 80.0, 65.0)
    image = bpy.data.images.new("sky", WIDTH, HEIGHT, float_buffer=True)
    image.pixels.foreach_set(pixels.ravel())
    image.filepath_raw, image.file_format = path, "OPEN_EXR"
    image.save()
    bpy.data.images.remove(image)


def build(sockets, side, sky_path):
    """8 bounces; a sphere on a grey plane."""
    scene = common.empty_scene(side, side, bounces=8)
    scene.render.threads_mode, scene.render.threads = "FIXED", 1
    ball = common.sphere("Ball", (0.0, 0.0, 1.0), segments=128, rings=64)
    ball.data.materials.append(common.material("Ball", "ShaderNodeBsdfPrincipled", **sockets)[0])
    ground = common.plane("Ground", 20.0)
    ground.data.materials.append(common.diffuse("Ground", (0.5, 0.5, 0.5)))
    world = bpy.data.worlds.new("World")
    world.use_nodes = True
    background = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    texture = world.node_tree.nodes.new("ShaderNodeTexEnvironment")
    texture.image = bpy.data.images.load(sky_path)
    texture.image.colorspace_settings.name = "Linear Rec.709"
    world.node_tree.links.new(texture.outputs[0], background.inputs[0])
    scene.world = world
    common.camera(scene, (0.0, -5.0, 1.6), (0.0, 0.0, 1.0), 28.0)
    return scene


def main(args):
    """Build, save and export all of them."""
    folder = os.path.abspath(args[0])
    os.makedirs(folder, exist_ok=True)
    sky_path = os.path.join(folder, "sky.exr")
    sky(sky_path)
    for name, sockets in SPHERES.items():
        scene = build(sockets, int(args[1]), sky_path)
        export(scene, os.path.join(folder, name))
        bpy.ops.wm.save_as_mainfile(filepath=os.path.join(folder, name + ".blend"))
    return 0


if __name__ == "__main__":
    pinned_cycles.run(main)
