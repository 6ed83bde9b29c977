"""Builds gallery.blend: a turned figure in a studio, one material after another on it.

    blender -b --factory-startup --python blender/scenes/gallery.py -- gallery.blend

The figure is exported in gold of textured roughness; benches/gallery.py puts
other materials in its place. The texture is computed here and packed into the
.blend, as is the environment (see studio.py).
"""

import math
import os
import sys

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

import bpy  # noqa: E402
import common  # noqa: E402
from studio import image, smoothstep, studio_world  # noqa: E402

# The outline from the foot to the crown: distance from the axis, height (metres).
OUTLINE = ((0.0, 0.0), (0.52, 0.0), (0.6, 0.05), (0.58, 0.17), (0.46, 0.26), (0.33, 0.42),
           (0.24, 0.68), (0.23, 0.9), (0.31, 1.0), (0.4, 1.05), (0.38, 1.11), (0.27, 1.15),
           (0.4, 1.28), (0.47, 1.47), (0.4, 1.68), (0.22, 1.81), (0.0, 1.85))


def outline(count):
    """Points on a Catmull-Rom curve through OUTLINE, both ends on the axis."""
    p = np.array(OUTLINE)
    p = np.vstack([2 * p[0] - p[1], p, 2 * p[-1] - p[-2]])
    t = np.linspace(0.0, len(OUTLINE) - 1.0, count)
    i = np.minimum(t.astype(int), len(OUTLINE) - 2)
    f = (t - i)[:, None]
    a, b, c, d = (p[i + k] for k in range(4))
    curve = 0.5 * (2 * b + (c - a) * f + (2 * a - 5 * b + 4 * c - d) * f**2 + (3 * b - a - 3 * c + d) * f**3)
    curve = np.maximum(curve, 0.0)
    curve[[0, -1], 0] = 0.0
    return curve


def figure(segments=40, rings=56):
    """A closed, smooth solid of revolution; u runs round it, v up."""
    curve = outline(rings + 1)
    vertices, rows = [], []
    for k, (r, z) in enumerate(curve):
        if k in (0, rings):
            rows.append([len(vertices)] * (segments + 1))
            vertices.append((0.0, 0.0, z))
            continue
        first = len(vertices)
        for s in range(segments):
            turn = 2.0 * math.pi * s / segments
            vertices.append((r * math.cos(turn), r * math.sin(turn), z))
        rows.append([first + s % segments for s in range(segments + 1)])
    faces, uvs = [], []
    for k in range(rings):
        for s in range(segments):
            corners = [(k, s), (k, s + 1), (k + 1, s + 1), (k + 1, s)]
            if k == 0:
                corners = [corners[0], corners[2], corners[3]]
            elif k == rings - 1:
                corners = corners[:3]
            faces.append([rows[i][j] for i, j in corners])
            uvs += [(j / segments, i / rings) for i, j in corners]
    mesh = bpy.data.meshes.new("Figure")
    mesh.from_pydata(vertices, [], faces)
    layer = mesh.uv_layers.new(name="UVMap")
    layer.data.foreach_set("uv", np.array(uvs, dtype=np.float32).ravel())
    ob = bpy.data.objects.new("Figure", mesh)
    bpy.context.scene.collection.objects.link(ob)
    return common.smooth(ob)


def blotches(size=128):
    """Roughness, 0.15 to 1: periodic blotches with soft edges."""
    rng = np.random.default_rng(11)
    fu, fv = np.meshgrid(np.fft.fftfreq(size) * size, np.fft.fftfreq(size) * size)
    frequency = np.hypot(fu, fv)
    band = np.exp(-((frequency - 5.0) / 3.0) ** 2)
    noise = np.fft.ifft2(np.fft.fft2(rng.standard_normal((size, size))) * band).real
    share = smoothstep(noise / noise.std() / 0.8 + 0.5)
    return np.repeat((0.15 + 0.85 * share)[:, :, None], 3, axis=2)


def build():
    """192 × 256, 64 spp, 12 bounces."""
    scene = common.empty_scene(192, 256, note=(
        "A turned figure in the light of an environment map, here in gold of textured roughness."))
    ob = figure()
    mat, node = common.material("Figure", "ShaderNodeBsdfGlossy", Color=(1.0, 0.71, 0.29))
    node.distribution = "MULTI_GGX"
    lookup = mat.node_tree.nodes.new("ShaderNodeTexImage")
    lookup.image = image("blotches", blotches())
    mat.node_tree.links.new(lookup.outputs["Color"], node.inputs["Roughness"])
    ob.data.materials.append(mat)
    ground = common.plane("Ground", 30.0)
    ground.location.z = -1e-3  # the foot of a glass figure must not touch it
    ground.data.materials.append(common.diffuse("Ground", (0.4, 0.4, 0.4)))
    studio_world(scene)
    common.camera(scene, (0.0, -6.0, 2.2), (0.0, 0.0, 0.87), 23.5)


if __name__ == "__main__":
    common.main(build)
