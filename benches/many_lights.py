#!/usr/bin/env python3
"""What many lamps cost: relMSE × CPU seconds with 10 lamps and with more, of the same
total power spread evenly, here and in Cycles with its light tree and without.

    benches/many_lights.py -o DIR [--bpy DIR] [--smithwalk BINARY] [--lamps 10,10000]

A diffuse floor of 20 m with a hundred cubes, under spheres of 5 cm in a grid at 1.5 m.
Every renderer is held against its own converged images, as in benches/peers/race.py:
two of `--reference-spp`, whose own noise is subtracted. Images take turns. CPU seconds
are those of rendering, the reading of the scene left out here and left in by Cycles'
render operator. Prints a table for docs/benchmarks.md.
"""

import argparse
import json
import os
import re
import statistics
import sys

ROOT = os.path.normpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
SIDE, BOUNCES, POWER = 20.0, 3, 4000.0
CUBES = [(2.0 * (i % 10) - 9.0, 2.0 * (i // 10) - 9.0) for i in range(100)]
CORNERS = [(x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]
FACES = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (1, 3, 7, 5), (3, 2, 6, 7), (2, 0, 4, 6)]
CUBE, CAMERA, FOV, IMAGE = 0.3, (0.0, -16.0, 9.0), 50.0, (96, 72)


def lamps(count):
    """The places of so many lamps."""
    columns = round(count ** 0.5 + 0.499)
    rows = -(-count // columns)
    return [(SIDE * ((i % columns + 0.5) / columns - 0.5), SIDE * ((i // columns + 0.5) / rows - 0.5), 1.5)
            for i in range(count)]


def write_scene(folder, count):
    """The path of a scene file."""
    with open(os.path.join(folder, "floor.obj"), "w", encoding="ascii") as file:
        file.write("".join(f"v {x * SIDE / 2} {y * SIDE / 2} 0\n" for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))))
        file.write("f 1 2 3 4\n")
    with open(os.path.join(folder, "cube.obj"), "w", encoding="ascii") as file:
        file.write("".join("v {} {} {}\n".format(*(CUBE * c for c in corner)) for corner in CORNERS))
        file.write("".join("f {} {} {} {}\n".format(*(i + 1 for i in face)) for face in FACES))
    path = os.path.join(folder, f"lamps{count}.yaml")
    with open(path, "w", encoding="ascii") as file:
        file.write(f"""smithwalk: 1
camera: {{projection: {{perspective: {{fov: {FOV}}}}}, transform: {{look_at: {{from: {list(CAMERA)}, to: [0, 0, 0]}}}}}}
film: {{width: {IMAGE[0]}, height: {IMAGE[1]}}}
sampling: {{max_bounces: {BOUNCES}}}
materials: {{grey: {{diffuse: {{color: 0.5}}}}}}
meshes: {{floor: {{file: floor.obj}}, cube: {{file: cube.obj}}}}
objects:
- {{mesh: floor, material: grey}}
""")
        file.writelines(f"- {{mesh: cube, material: grey, transform: {{location: [{x}, {y}, {CUBE}]}}}}\n"
                        for x, y in CUBES)
        file.write("lights:\n")
        file.writelines(f"- {{point: {{power: {POWER / count}, radius: 0.05, soft_falloff: false, "
                        f"transform: {{location: [{x}, {y}, {z}]}}}}}}\n" for x, y, z in lamps(count))
    return path


def cycles(args):
    """Runs inside bpy: renders jobs with Cycles."""
    import bpy
    from mathutils import Vector
    sys.path.insert(0, os.path.join(ROOT, "blender"))
    import pinned_cycles

    count, tree, jobs, results = int(args[0]), args[1] == "tree", args[2], args[3]
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    grey = bpy.data.materials.new("grey")
    grey.use_nodes = True
    nodes = grey.node_tree.nodes
    nodes.clear()
    diffuse, output = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeOutputMaterial")
    diffuse.inputs["Color"].default_value = (0.5, 0.5, 0.5, 1)
    grey.node_tree.links.new(diffuse.outputs[0], output.inputs[0])

    def mesh(name, vertices, faces):
        data = bpy.data.meshes.new(name)
        data.from_pydata(vertices, [], faces)
        data.materials.append(grey)
        return data

    def put(name, data, place):
        item = bpy.data.objects.new(name, data)
        item.location = place
        scene.collection.objects.link(item)
        return item
    half = SIDE / 2
    put("floor", mesh("floor", [(-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)],
                      [(0, 1, 2, 3)]), (0, 0, 0))
    cube = mesh("cube", [tuple(CUBE * c for c in corner) for corner in CORNERS], FACES)
    for x, y in CUBES:
        put("cube", cube, (x, y, CUBE))
    lamp = bpy.data.lights.new("lamp", "POINT")
    lamp.energy, lamp.shadow_soft_size, lamp.use_soft_falloff = POWER / count, 0.05, False
    for place in lamps(count):
        put("lamp", lamp, place)
    camera = bpy.data.cameras.new("camera")
    camera.angle = FOV * 3.141592653589793 / 180
    seen = put("camera", camera, CAMERA)
    seen.rotation_euler = (-Vector(CAMERA)).to_track_quat("-Z", "Y").to_euler()
    scene.camera = seen
    scene.render.resolution_x, scene.render.resolution_y = IMAGE
    scene.render.resolution_percentage = 100
    with open(jobs, encoding="utf-8") as file:
        jobs = json.load(file)
    times = []
    for job in jobs:
        pinned_cycles.pin(scene, job["spp"], job["seed"], BOUNCES)
        scene.cycles.use_light_tree = tree
        pixels, cpu = pinned_cycles.render_array(scene)
        times.append(cpu)
        pinned_cycles.write_exr(scene, job["out"], pixels)
    with open(results, "w", encoding="utf-8") as file:
        json.dump({"version": pinned_cycles.version(), "cpu": times}, file)
    return 0


class Ours:
    """This renderer with so many lamps."""

    def __init__(self, args, count):
        self.name, self.lamps, self.binary = "smithwalk", count, args.smithwalk
        self.scene = write_scene(args.output, count)

    def render(self, jobs):
        """CPU seconds of each job."""
        def one(job):
            said = run([self.binary, "render", self.scene, "-o", job["out"],
                        "--spp", str(job["spp"]), "--seed", str(job["seed"])])
            return float(re.search(r"\(([\d.]+) s CPU\)", said)[1])
        return [one(job) for job in jobs]


class Cycles:
    """Cycles with so many lamps."""

    def __init__(self, args, count, tree):
        self.name, self.lamps, self.args, self.tree = "Cycles", count, args, "tree" if tree else "flat"

    def render(self, jobs):
        """CPU seconds of each job."""
        jobs_file, results = (os.path.join(self.args.output, name) for name in ("jobs.json", "results.json"))
        with open(jobs_file, "w", encoding="utf-8") as file:
            json.dump(jobs, file)
        run([sys.executable, os.path.abspath(__file__), "cycles", str(self.lamps), self.tree, jobs_file, results],
            PYTHONPATH=self.args.bpy)
        with open(results, encoding="utf-8") as file:
            answer = json.load(file)
        self.name = f"Cycles {answer['version']}, {'light tree' if self.tree == 'tree' else 'no light tree'}"
        return answer["cpu"]


def main():
    """References and images of all, then the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", required=True, help="folder for images")
    parser.add_argument("--smithwalk", default=os.path.join(ROOT, "target/release/smithwalk"))
    parser.add_argument("--bpy", help="folder of the bpy module; without it Cycles is left out")
    parser.add_argument("--lamps", default="10,10000")
    parser.add_argument("--spp", type=int, default=16)
    parser.add_argument("--reference-spp", type=int, default=512)
    parser.add_argument("--seeds", type=int, default=3)
    args = parser.parse_args()
    os.makedirs(args.output, exist_ok=True)
    counts = [int(count) for count in args.lamps.split(",")]
    contenders = [Ours(args, count) for count in counts]
    if args.bpy:
        contenders += [Cycles(args, count, tree) for tree in (True, False) for count in counts]

    def diff(a, b):
        return json.loads(run([args.smithwalk, "diff", a, b, "--json"]))["rel_mse_trimmed"]

    print("| | lamps | CPU s | relative RMSE | relMSE × CPU s | spread | over that of the fewest lamps |")
    print("|---|---|---|---|---|---|---|")
    fewest = {}
    for index, one in enumerate(contenders):
        def job(spp, seed):
            return {"spp": spp, "seed": seed, "out": os.path.join(args.output, f"{index}-{spp}-{seed}.exr")}
        references = [job(args.reference_spp, 101), job(args.reference_spp, 102)]
        images = [job(args.spp, seed) for seed in range(1, args.seeds + 1)]
        times = one.render(references + images)[2:]
        a, b = (reference["out"] for reference in references)
        floor = diff(a, b) / 2
        errors = [(diff(image["out"], a) + diff(image["out"], b)) / 2 - floor for image in images]
        costs = [error * time for error, time in zip(errors, times)]
        cost = statistics.fmean(costs)
        spread = statistics.stdev(costs) / cost if len(costs) > 1 else 0
        ratio = cost / fewest.setdefault(one.name, cost)
        print(f"| {one.name} | {one.lamps} | {statistics.fmean(times):.2f} | {statistics.fmean(errors) ** 0.5:.4f} "
              f"| {cost:.2e} | ± {100 * spread:.0f} % | {ratio:.2f} |", flush=True)
    return 0


if __name__ == "__main__":
    if sys.argv[1:2] == ["cycles"]:
        sys.path.insert(0, os.path.join(ROOT, "blender"))
        import pinned_cycles as instrument
        instrument.run(lambda args: cycles(args[1:]))
    from command import run
    sys.exit(main())
