"""Renders jobs with Mitsuba 3; a worker of race.py.

    python3 benches/peers/mitsuba_worker.py SCENE_DIR JOBS.json RESULTS.json VARIANT SAMPLER BOUNCES

The gold sphere of scenes/gold_sphere, its meshes read from there. Times are
those of rendering alone; kernels of the llvm variants are compiled before, by
a render with another seed.
"""

import json
import os
import resource
import sys
import time

import mitsuba as mi


def cpu_seconds():
    """Of all threads of this process."""
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def gold_sphere(folder, sampler, bounces):
    """The scene as a dictionary: α = 0.8², area light of 200 W with Blender 3.4's
    radiance P/(4A), one-sided, along its −z."""
    transform = mi.ScalarTransform4f

    def rgb(*values):
        return {"type": "rgb", "value": list(values)}

    light = transform([[0.6246951, -0.5339296, 0.5698029, 2.5],
                       [0.7808688, 0.4271436, -0.4558423, -2.0],
                       [1.842803e-08, 0.7297037, 0.6837634, 4.0],
                       [0.0, 0.0, 0.0, 1.0]])
    flip = transform().rotate([1, 0, 0], 180)
    return {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": bounces + 1},
        "sensor": {
            "type": "perspective", "fov": 35.0,
            "to_world": transform().look_at(origin=[0, -6, 2.5], target=[0, 0, 0.9], up=[0, 0, 1]),
            "film": {"type": "hdrfilm", "width": 256, "height": 256, "pixel_format": "rgb",
                     "component_format": "float32", "rfilter": {"type": "box"}},
            "sampler": {"type": sampler},
        },
        "world": {"type": "constant", "radiance": rgb(0.25, 0.3, 0.4)},
        "key": {
            "type": "rectangle",
            "to_world": light @ flip @ transform().scale([0.75, 0.5, 1.0]),
            "emitter": {"type": "area", "radiance": rgb(*[200.0 / (4.0 * 1.5)] * 3)},
        },
        "ball": {
            "type": "obj", "filename": os.path.join(folder, "ball.obj"),
            "to_world": transform().translate([0, 0, 1]),
            "bsdf": {"type": "roughconductor", "material": "none", "distribution": "ggx",
                     "alpha": 0.64, "specular_reflectance": rgb(1.0, 0.71, 0.29)},
        },
        "ground": {
            "type": "obj", "filename": os.path.join(folder, "ground.obj"),
            "bsdf": {"type": "diffuse", "reflectance": rgb(0.5, 0.5, 0.5)},
        },
    }


def main(folder, jobs, results, variant, sampler, bounces):
    """Every job in turn."""
    mi.set_variant(variant)
    import drjit as dr

    scene = mi.load_dict(gold_sphere(folder, sampler, int(bounces)))
    with open(jobs, encoding="utf-8") as file:
        jobs = json.load(file)

    def render(spp, seed):
        # A wavefront of more than 2³² samples does not exist: references come
        # in parts.
        part = min(spp, 256)
        count = spp // part
        total = None
        for index in range(count):
            image = mi.render(scene, spp=part, seed=seed * 1000 + index)
            dr.eval(image)
            dr.sync_thread()
            total = image if total is None else total + image
        return total / count

    if variant.startswith("llvm"):
        for spp in sorted({min(job["spp"], 256) for job in jobs}):
            render(spp, 999)
    measured = []
    for job in jobs:
        wall, cpu = time.monotonic(), cpu_seconds()
        image = render(job["spp"], job["seed"])
        dr.sync_thread()
        measured.append({"wall_s": time.monotonic() - wall, "cpu_s": cpu_seconds() - cpu})
        mi.util.write_bitmap(job["out"], image, write_async=False)
    with open(results, "w", encoding="utf-8") as file:
        json.dump({"version": f"Mitsuba {mi.__version__}", "results": measured}, file)


if __name__ == "__main__":
    main(*sys.argv[1:])
