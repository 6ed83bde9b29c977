"""Measure directional albedos of Cycles' rough closures.

    blender -b --factory-startup --python blender/measure_albedo.py -- OUT_DIR
    PYTHONPATH=<bpy> python3 blender/measure_albedo.py OUT_DIR

Writes OUT_DIR/cycles_<major.minor>_albedo_conductor.csv and
…_dielectric.csv; tests/data holds those of 3.4, 4.5 and 5.0.

A sheet of square patches, one material each, lies in the plane z = 0 and an
orthographic camera looks at it with view direction ω_o = (0, −sinθ, cosθ).
The world alone shines, found by BSDF sampling alone, so a patch shows the
directional albedo. For glass the upper half of the world is red and the lower
green: reflectance and transmittance in one image. A patch covers 4 × 4 pixels,
whose scatter gives the standard error. Never cosθ = 1: Cycles 3.4 turns into a
mirror there.
"""

import argparse
import csv
import math
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "scenes"))

import bpy  # noqa: E402
import common  # noqa: E402
import numpy as np  # noqa: E402
import pinned_cycles  # noqa: E402

COSINES = (0.999, 0.75, 0.5, 0.25, 0.1, 0.05)
ROUGHNESSES = tuple(round(0.1 * i, 1) for i in range(1, 11))
GOLD = (1.0, 0.71, 0.29)  # its red channel is the white furnace
IOR = 1.5
PIXELS = 4    # per side of a patch
COLUMNS = 10  # patches


def conductors():
    """(distribution, roughness, anisotropy, rotation) of the metals to measure.

    Anisotropic ones in the distributions that have a counterpart here: the
    walk of 3.x, the height-correlated single scattering of 4.x.
    """
    rows = [(d, r, 0.0, 0.0) for d in ("MULTI_GGX", "GGX", "BECKMANN") for r in ROUGHNESSES]
    anisotropic = ("MULTI_GGX",) if bpy.app.version < (4, 0, 0) else ("GGX", "BECKMANN")
    rows += [(d, r, a, t) for d in anisotropic for r in (0.2, 0.35, 0.5, 0.7, 1.0)
             for a in (0.4, 0.8, -0.6) for t in (0.0, 0.125, 0.25)]
    return rows


def metal(distribution, roughness, anisotropy, rotation):
    """An Anisotropic node (in 4.x Glossy is the same node) with the UV tangent, here +x."""
    mat, node = common.material("Metal", "ShaderNodeBsdfAnisotropic", Color=GOLD, Roughness=roughness,
                                Anisotropy=anisotropy, Rotation=rotation)
    node.distribution = distribution
    tangent = mat.node_tree.nodes.new("ShaderNodeTangent")
    tangent.direction_type, tangent.uv_map = "UV_MAP", "UVMap"
    mat.node_tree.links.new(tangent.outputs[0], node.inputs["Tangent"])
    return mat


def glass(distribution, roughness):
    """A Glass node of white colour."""
    mat, node = common.material("Glass", "ShaderNodeBsdfGlass", Color=(1.0, 1.0, 1.0),
                                Roughness=roughness, IOR=IOR)
    node.distribution = distribution
    return mat


def sheet(scene, materials):
    """The patches as one mesh, each 1 × 1 before the view stretches it."""
    rows = -(-len(materials) // COLUMNS)
    vertices, faces = [], []
    for i in range(len(materials)):
        x, y = i % COLUMNS - COLUMNS / 2, rows / 2 - i // COLUMNS
        faces.append(tuple(range(4 * i, 4 * i + 4)))
        vertices += [(x, y - 1, 0.0), (x + 1, y - 1, 0.0), (x + 1, y, 0.0), (x, y, 0.0)]
    mesh = bpy.data.meshes.new("Sheet")
    mesh.from_pydata(vertices, [], faces)
    uvs = mesh.uv_layers.new(name="UVMap")
    for polygon in mesh.polygons:
        polygon.material_index = polygon.index
        for loop, uv in zip(polygon.loop_indices, ((0, 0), (1, 0), (1, 1), (0, 1))):
            uvs.data[loop].uv = uv
    for material in materials:
        mesh.materials.append(material)
    ob = bpy.data.objects.new("Sheet", mesh)
    scene.collection.objects.link(ob)
    scene.render.resolution_x, scene.render.resolution_y = COLUMNS * PIXELS, rows * PIXELS
    data = bpy.data.cameras.new("Camera")
    data.type, data.sensor_fit, data.ortho_scale = "ORTHO", "HORIZONTAL", COLUMNS
    data.clip_end = 2000.0
    scene.camera = bpy.data.objects.new("Camera", data)
    scene.collection.objects.link(scene.camera)
    return ob


def view(scene, ob, cosine, above):
    """Turn the camera to cosθ on one side; stretch the sheet so that a patch keeps its pixels."""
    ob.scale = (1.0, 1.0 / cosine, 1.0)
    sine = math.sqrt(1.0 - cosine * cosine)
    direction = (0.0, -sine, cosine if above else -cosine)
    scene.camera.location = [500.0 * c for c in direction]
    # Rotation about x alone: from below the image is upside down, and so
    # `patches` reads its rows the other way round.
    angle = math.atan2(sine, direction[2])
    scene.camera.rotation_euler = (angle, 0.0, 0.0)


def patches(pixels, count, above):
    """Mean and standard error of each patch's pixels, (count, 3) each."""
    rows = pixels.shape[0] // PIXELS
    blocks = pixels.astype(np.float64).reshape(rows, PIXELS, COLUMNS, PIXELS, 3)
    blocks = blocks.transpose(0, 2, 1, 3, 4).reshape(rows, COLUMNS, PIXELS * PIXELS, 3)
    if not above:
        blocks = blocks[::-1]
    values = blocks.reshape(rows * COLUMNS, PIXELS * PIXELS, 3)[:count]
    return values.mean(axis=1), values.std(axis=1, ddof=1) / PIXELS


def split_world(scene):
    """Red from above, green from below."""
    common.constant_world(scene, (0.0, 0.0, 0.0), 1.0)
    tree = scene.world.node_tree
    names = ("TexCoord", "SeparateXYZ", "Math", "Math", "CombineXYZ")
    coordinates, separate, up, down, combine = (tree.nodes.new(f"ShaderNode{n}") for n in names)
    up.operation, down.operation = "GREATER_THAN", "LESS_THAN"
    background = next(n for n in tree.nodes if n.type == "BACKGROUND")
    tree.links.new(coordinates.outputs["Generated"], separate.inputs[0])
    for i, step in enumerate((up, down)):
        tree.links.new(separate.outputs["Z"], step.inputs[0])
        step.inputs[1].default_value = 0.0
        tree.links.new(step.outputs[0], combine.inputs[i])
    tree.links.new(combine.outputs[0], background.inputs["Color"])


def write(path, header, rows, spp):
    """A CSV under one comment line with version and settings."""
    with open(path, "w", newline="", encoding="utf-8") as f:
        f.write(f"# Cycles of Blender {pinned_cycles.version()}, measure_albedo.py: "
                f"{spp * PIXELS * PIXELS} samples per row, BSDF sampling, seed 1\n")
        out = csv.writer(f, lineterminator="\n")
        out.writerow(header)
        out.writerows(rows)
    print(f"wrote {path}: {len(rows)} rows")


def numbers(values):
    """Six decimals."""
    return [f"{v:.6f}" for v in values]


def measure_conductors(path, spp):
    """Reflectance of gold per channel."""
    scene = common.empty_scene(8, 8)
    common.constant_world(scene, (1.0, 1.0, 1.0), 1.0)
    configurations = conductors()
    ob = sheet(scene, [metal(*c) for c in configurations])
    rows = []
    for cosine in COSINES:
        view(scene, ob, cosine, above=True)
        mean, error = patches(shoot(scene, spp), len(configurations), above=True)
        rows += [[*c, cosine, *numbers(m), *numbers(e)] for c, m, e in zip(configurations, mean, error)]
    write(path, ["distribution", "roughness", "anisotropy", "rotation", "cos",
                 "red", "green", "blue", "red_se", "green_se", "blue_se"], rows, spp)


def measure_dielectrics(path, spp):
    """Reflectance and transmittance of glass, from outside and from inside."""
    scene = common.empty_scene(8, 8)
    split_world(scene)
    configurations = [(d, r) for d in ("MULTI_GGX", "GGX", "BECKMANN") for r in ROUGHNESSES]
    ob = sheet(scene, [glass(*c) for c in configurations])
    rows = []
    for side in ("outside", "inside"):
        above = side == "outside"
        for cosine in COSINES:
            view(scene, ob, cosine, above)
            mean, error = patches(shoot(scene, spp), len(configurations), above)
            r, t = (0, 1) if above else (1, 0)
            rows += [[*c, IOR, side, cosine, *numbers((m[r], m[t], e[r], e[t]))]
                     for c, m, e in zip(configurations, mean, error)]
    write(path, ["distribution", "roughness", "ior", "side", "cos", "r", "t", "r_se", "t_se"], rows, spp)


def shoot(scene, spp):
    """One image with light found by BSDF sampling alone."""
    scene.world.cycles.sampling_method = "NONE"
    pinned_cycles.pin(scene, spp, seed=1, bounces=1)
    return pinned_cycles.render_array(scene)[0]


def main(args):
    """Measure both tables."""
    parser = argparse.ArgumentParser(prog="measure_albedo.py")
    parser.add_argument("out")
    parser.add_argument("--spp", type=int, default=8192, help="a sixteenth of the samples per row")
    args = parser.parse_args(args)
    os.makedirs(args.out, exist_ok=True)
    stem = os.path.join(args.out, "cycles_{}.{}_albedo".format(*bpy.app.version[:2]))
    measure_conductors(f"{stem}_conductor.csv", args.spp)
    measure_dielectrics(f"{stem}_dielectric.csv", args.spp)
    return 0


if __name__ == "__main__":
    pinned_cycles.run(main)
