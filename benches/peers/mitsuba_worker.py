"""Renders jobs with Mitsuba 3; a worker of race.py.

    python3 benches/peers/mitsuba_worker.py SCENE_DIR JOBS.json RESULTS.json VARIANT SAMPLER

Translates SCENE_DIR/scene.yaml as far as the scenes of the race need it, and
says on standard output what it leaves out. What differs: Mitsuba scatters once
and masks by a product of two functions; a glass colour counts once, not at
every facet; `roughconductor` takes no rotation of its tangent; lamps hide what
lies behind them. Times are those of rendering alone; kernels of the llvm
variants are compiled before, by a render with another seed. Needs PyYAML.
"""

import json
import math
import os
import resource
import sys
import time

import mitsuba as mi
import numpy as np
import yaml


def cpu_seconds():
    """Of all threads of this process."""
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def rgb(color, factor=1.0):
    """A colour of the scene file, a list or one number, times `factor`."""
    color = color if isinstance(color, list) else [color] * 3
    return {"type": "rgb", "value": [factor * c for c in color]}


def matrix(entry):
    """The 4 × 4 array of a transform, as the exporter writes it."""
    return np.array(entry["transform"]["matrix"], dtype=np.float64)


def euler(degrees):
    """The rotation of Blender's Euler XYZ angles, 3 × 3."""
    x, y, z = (math.radians(d) for d in degrees)
    rx = np.array([[1, 0, 0], [0, math.cos(x), -math.sin(x)], [0, math.sin(x), math.cos(x)]])
    ry = np.array([[math.cos(y), 0, math.sin(y)], [0, 1, 0], [-math.sin(y), 0, math.cos(y)]])
    rz = np.array([[math.cos(z), -math.sin(z), 0], [math.sin(z), math.cos(z), 0], [0, 0, 1]])
    return rz @ ry @ rx


class Translation:
    """A scene file as a dictionary of Mitsuba's."""

    def __init__(self, folder, sampler):
        self.folder, self.sampler = folder, sampler
        with open(os.path.join(folder, "scene.yaml"), encoding="utf-8") as file:
            self.file = yaml.safe_load(file)
        assert self.file["light_units"] == "cycles_3"

    def scene(self):
        """All of it."""
        bounces = self.file["sampling"]["max_bounces"]
        # Depth 2 is what Blender counts as no bounce: direct light.
        scene = {"type": "scene", "integrator": {"type": "path", "max_depth": bounces + 2},
                 "sensor": self.sensor()}
        world = self.world()
        if world:
            scene["world"] = world
        for index, light in enumerate(self.file.get("lights", [])):
            scene[f"light{index}"] = self.area_light(light["area"])
        for index, entry in enumerate(self.file["objects"]):
            scene[f"object{index}"] = {
                "type": "obj", "filename": self.path(self.file["meshes"][entry["mesh"]]),
                "to_world": mi.ScalarTransform4f(matrix(entry)),
                "bsdf": self.bsdf(entry["material"]),
            }
        return scene

    def path(self, entry):
        """The file that a mesh, a texture or the world names."""
        return os.path.join(self.folder, entry["file"])

    def sensor(self):
        """Blender's camera looks along −z, Mitsuba's along +z with x to the left."""
        camera, film = self.file["camera"], self.file["film"]
        lens = camera["projection"]["perspective"]
        return {
            "type": "perspective", "fov_axis": "larger",
            "fov": 2.0 * math.degrees(math.atan(lens["sensor_width"] / (2.0 * lens["lens"]))),
            "to_world": mi.ScalarTransform4f(matrix(camera) @ np.diag([-1.0, 1.0, -1.0, 1.0])),
            "film": {"type": "hdrfilm", "width": film["width"], "height": film["height"],
                     "pixel_format": "rgb", "component_format": "float32", "rfilter": {"type": "box"}},
            "sampler": {"type": self.sampler},
        }

    def world(self):
        """A constant or an environment map; None if black."""
        world = self.file.get("world", {})
        if "constant" in world:
            constant = world["constant"]
            if constant["strength"] == 0.0:
                return None
            return {"type": "constant", "radiance": rgb(constant["color"], constant["strength"])}
        if "environment" not in world:
            return None
        environment = world["environment"]
        # Blender looks d' = R·d up at u = 1/2 − atan2(d'y, d'x)/2π, Mitsuba its
        # local direction at u = atan2(x, −z)/2π: x, y, z are d'y, d'z, d'x.
        axes = np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0]], dtype=np.float64)
        to_world = np.eye(4)
        to_world[:3, :3] = (axes @ euler(environment["rotation"])).T
        return {"type": "envmap", "filename": self.path(environment), "scale": environment["strength"],
                "to_world": mi.ScalarTransform4f(to_world)}

    @staticmethod
    def area_light(light):
        """Radiance P/(4A) along the light's −z, as in Blender 3.4."""
        shape = light["shape"]["rectangle"]
        size = [shape["width"] / 2.0, shape["height"] / 2.0, 1.0]
        turn = np.diag([1.0, -1.0, -1.0, 1.0])
        return {
            "type": "rectangle",
            "to_world": mi.ScalarTransform4f(matrix(light) @ turn @ np.diag([*size, 1.0])),
            "emitter": {"type": "area", "radiance": rgb(
                light.get("color", 1.0), light["power"] / (4.0 * shape["width"] * shape["height"]))},
        }

    def bsdf(self, name):
        """Lambert, or single-scattering GGX."""
        (kind, keys), = self.file["materials"][name].items()
        if kind == "diffuse":
            return {"type": "diffuse", "reflectance": rgb(keys["color"])}
        alpha_u, alpha_v = self.alphas(keys)
        if kind == "conductor":
            if "rotation" in keys:
                print(f"{name}: the rotation of the tangent is left out")
            return {"type": "roughconductor", "material": "none", "distribution": "ggx",
                    "alpha_u": alpha_u, "alpha_v": alpha_v, "specular_reflectance": rgb(keys["color"])}
        assert kind == "dielectric", kind
        color = keys.get("color", 1.0)
        return {"type": "roughdielectric", "distribution": "ggx", "alpha": alpha_u,
                "int_ior": keys["ior"], "ext_ior": 1.0,
                "specular_reflectance": rgb(color), "specular_transmittance": rgb(color)}

    def alphas(self, keys):
        """α along u and v from roughness and anisotropy (0 to 1), constant or textured."""
        roughness = self.values(keys["roughness"])
        anisotropy = self.values(keys.get("anisotropy", 0.0))
        alpha = roughness ** 2
        along = alpha * (1.0 - anisotropy)
        across = np.minimum(alpha / np.maximum(1.0 - anisotropy, 1e-6), 1.0)
        if np.ndim(along) == 0:
            return float(along), float(across)
        scale = self.file["textures"][keys["roughness"]["texture"]].get("scale", [1.0, 1.0])
        return tuple({
            "type": "bitmap", "raw": True, "filter_type": "bilinear", "wrap_mode": "repeat",
            "bitmap": mi.Bitmap(values.astype(np.float32)[:, :, None]),
            "to_uv": mi.ScalarTransform3f().scale(scale),
        } for values in (along, across))

    def values(self, value):
        """A number, or the first channel of a grey texture as it is stored."""
        if not isinstance(value, dict):
            return value
        bitmap = mi.Bitmap(self.path(self.file["textures"][value["texture"]]))
        pixels = np.array(bitmap).astype(np.float64) / 255.0
        return pixels if pixels.ndim == 2 else pixels[:, :, 0]


def main(folder, jobs, results, variant, sampler):
    """Every job in turn."""
    mi.set_variant(variant)
    import drjit as dr

    scene = mi.load_dict(Translation(folder, sampler).scene())
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
