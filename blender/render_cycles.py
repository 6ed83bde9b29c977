"""Render a .blend with Cycles, pinned for a comparison, to a scene-linear EXR.

    blender -b file.blend --python blender/render_cycles.py -- OUT.exr [options]
    PYTHONPATH=<bpy> python3 blender/render_cycles.py file.blend OUT.exr [options]

Works in Blender 3.4, 4.5 and 5.0. With --seeds N the image is the mean over N
renders with seeds SEED … SEED + N − 1, fireflies left out per pixel (see
`robust_mean`): Cycles 3.4's Multiscatter GGX has rare ones that no number of
samples averages away. --json writes version, settings, CPU seconds and the
means of each seed.

Cycles 3.4's Multiscatter GGX evaluates to less than it samples: gold of
roughness 0.8 under the area light of the gold_sphere scene is 12 % darker in
green than when the same light is found by BSDF sampling alone. With
--no-light-sampling all light is found that way: noisier, but one model. That
helps pure materials only: in a mix, sampling one closure evaluates the other
(tiles that mix 30 % of it come out 1.2 % brighter than the weighted sum of
the two materials).
"""

import argparse
import json
import math
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

try:
    import bpy
    import numpy as np
    import pinned_cycles
except ImportError as missing:
    sys.exit(f"render_cycles.py: {missing}: run it by `blender -b FILE --python`, or with the bpy module")

_NODES = {"BSDF_GLOSSY", "BSDF_ANISOTROPIC", "BSDF_GLASS"}


def override(distribution=None, roughness=None):
    """Set the distribution or roughness of every Glossy, Anisotropic and Glass node."""
    for material in bpy.data.materials:
        for node in material.node_tree.nodes if material.node_tree else ():
            if node.type in _NODES:
                if distribution:
                    node.distribution = distribution
                if roughness is not None:
                    node.inputs["Roughness"].default_value = roughness


def no_light_sampling(scene):
    """Leave light to BSDF sampling alone: rectangle lights become emissive
    planes, and neither these nor the world are sampled directly."""
    per_watt = 4.0 if bpy.app.version < (4, 0, 0) else math.pi
    for ob in [o for o in scene.objects if o.type == "LIGHT" and not o.hide_render]:
        light = ob.data
        if light.type != "AREA" or light.shape not in {"SQUARE", "RECTANGLE"} or ob.visible_camera \
                or light.spread < math.pi * (1.0 - 1e-6) or getattr(light, "exposure", 0.0) != 0.0:
            raise SystemExit(f"--no-light-sampling can't replace the light {ob.name}")
        width, height = light.size, light.size_y if light.shape == "RECTANGLE" else light.size
        corners = [(x * width / 2, y * height / 2, 0.0) for x, y in ((-1, -1), (-1, 1), (1, 1), (1, -1))]
        mesh = bpy.data.meshes.new(ob.name)
        mesh.from_pydata(corners, [], [(0, 1, 2, 3)])  # this order faces −z
        x, y = (ob.matrix_world.to_3x3().col[i] for i in (0, 1))
        area = width * height * x.cross(y).length
        mesh.materials.append(_one_sided_emission(light, light.energy / (per_watt * area)))
        plane = bpy.data.objects.new(ob.name, mesh)
        plane.matrix_world = ob.matrix_world.copy()
        plane.visible_camera = False
        scene.collection.objects.link(plane)
        ob.hide_render = True
    for material in bpy.data.materials:
        if hasattr(material.cycles, "emission_sampling"):
            material.cycles.emission_sampling = "NONE"
        else:
            material.cycles.sample_as_light = False
    if scene.world:
        scene.world.cycles.sampling_method = "NONE"


def _one_sided_emission(light, radiance):
    """Emission from the front on top of full transparency: lamps hide nothing."""
    material = bpy.data.materials.new(light.name)
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    output, add, mix, emission = (
        tree.nodes.new(f"ShaderNode{n}") for n in ("OutputMaterial", "AddShader", "MixShader", "Emission"))
    emission.inputs["Color"].default_value = (*light.color, 1.0)
    emission.inputs["Strength"].default_value = radiance
    # An empty second input of the mix is black: no emission from behind.
    tree.links.new(tree.nodes.new("ShaderNodeNewGeometry").outputs["Backfacing"], mix.inputs[0])
    tree.links.new(emission.outputs[0], mix.inputs[1])
    tree.links.new(mix.outputs[0], add.inputs[0])
    tree.links.new(tree.nodes.new("ShaderNodeBsdfTransparent").outputs[0], add.inputs[1])
    tree.links.new(add.outputs[0], output.inputs["Surface"])
    return material


def main(args):
    """Parse, render, write."""
    parser = argparse.ArgumentParser(prog="render_cycles.py", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    if not bpy.app.binary_path:
        parser.add_argument("blend")
    parser.add_argument("out", help="the EXR to write")
    parser.add_argument("--spp", type=int, help="samples per pixel (the scene's)")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--seeds", type=int, default=1, help="how many seeds to average")
    parser.add_argument("--bounces", type=int, help="for all kinds of rays (the scene's maximum)")
    parser.add_argument("--distribution", choices=["GGX", "MULTI_GGX", "BECKMANN"])
    parser.add_argument("--roughness", type=float)
    parser.add_argument("--percent", type=int, help="of the scene's resolution")
    parser.add_argument("--half", action="store_true", help="16-bit floats")
    parser.add_argument("--scene-filter", action="store_true", help="keep the scene's pixel filter")
    parser.add_argument("--no-light-sampling", action="store_true", help="see above")
    parser.add_argument("--json", help="write version, settings and CPU seconds here")
    args = parser.parse_args(args)

    if not bpy.app.binary_path:
        bpy.ops.wm.open_mainfile(filepath=os.path.abspath(args.blend))
    scene = bpy.context.scene
    spp = args.spp or scene.cycles.samples
    override(args.distribution, args.roughness)
    if args.no_light_sampling:
        no_light_sampling(scene)
    if args.percent:
        scene.render.resolution_percentage = args.percent

    images, seconds = [], []
    for seed in range(args.seed, args.seed + args.seeds):
        pinned_cycles.pin(scene, spp, seed, args.bounces, box_filter=not args.scene_filter)
        pixels, cpu = pinned_cycles.render_array(scene)
        images.append(pixels)
        seconds.append(round(cpu, 3))
    stack = np.stack(images)
    mean, left_out = (stack[0], 0) if args.seeds == 1 else pinned_cycles.robust_mean(stack)
    os.makedirs(os.path.dirname(os.path.abspath(args.out)), exist_ok=True)
    pinned_cycles.write_exr(scene, args.out, mean, args.half)

    def channels(pixels):
        return [round(float(c), 6) for c in pixels.mean(axis=(0, 1), dtype=np.float64)]

    report = {
        "blender": pinned_cycles.version(),
        "spp": spp,
        "seeds": list(range(args.seed, args.seed + args.seeds)),
        "bounces": scene.cycles.max_bounces,
        "distribution": args.distribution,
        "roughness": args.roughness,
        "light_sampling": not args.no_light_sampling,
        "width": int(mean.shape[1]),
        "height": int(mean.shape[0]),
        "mean": channels(mean),
        "mean_per_seed": [channels(i) for i in images],
        "values_left_out": left_out,
        "cpu_seconds": seconds,
    }
    if args.json:
        with open(args.json, "w", encoding="ascii") as f:
            json.dump(report, f, indent=1)
            f.write("\n")
    print(f"wrote {args.out}: " + json.dumps(report))
    return 0


if __name__ == "__main__":
    pinned_cycles.run(main)
