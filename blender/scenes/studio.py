"""The studio that some scenes stand in, and images computed by their scripts."""

import math
import os
import tempfile

import bpy
import numpy as np

import common
import pinned_cycles


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


def environment_image(scene, name, radiance):
    """Radiance as a packed EXR of halves, which compresses to a small file."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, f"{name}.exr")
        pinned_cycles.write_exr(scene, path, radiance.astype(np.float32), half=True)
        img = bpy.data.images.load(path)
        img.pack()
    return img


def environment_world(scene, name, radiance, degrees=0.0):
    """An image as an environment texture, turned about z by a Mapping node."""
    common.constant_world(scene, (0.0, 0.0, 0.0), 1.0)
    tree = scene.world.node_tree
    background = next(n for n in tree.nodes if n.type == "BACKGROUND")
    lookup = tree.nodes.new("ShaderNodeTexEnvironment")
    lookup.image = environment_image(scene, name, radiance)
    mapping = tree.nodes.new("ShaderNodeMapping")
    mapping.inputs["Rotation"].default_value = (0.0, 0.0, math.radians(degrees))
    coordinates = tree.nodes.new("ShaderNodeTexCoord")
    tree.links.new(coordinates.outputs["Generated"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs[0], lookup.inputs[0])
    tree.links.new(lookup.outputs["Color"], background.inputs["Color"])


def studio_world(scene):
    """The studio as the world."""
    environment_world(scene, "studio", studio(), 20.0)
