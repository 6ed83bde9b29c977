"""Renders jobs with Mitsuba 3; a worker of race.py.

    python3 benches/peers/mitsuba_worker.py SCENE_DIR JOBS.json RESULTS.json VARIANT SAMPLER

Translates SCENE_DIR/scene.yaml as far as the scenes of the race need it, and
says on standard output what it leaves out. What differs: Mitsuba scatters once
and masks by a product of two functions; a glass colour counts once, not at
every facet; `roughconductor` takes no rotation of its tangent; `principled` is
Disney's of 2012; a pane is a sheet with two faces, and where there is one the
integrator is `volpath`, which alone lets light samples through; lamps hide what
lies behind them, where they are not seen the sky is not either, and the sun is a
disk 10 km away. Times are those of rendering
alone; kernels of the llvm variants are compiled before, by a render with another
seed. Needs PyYAML.
"""

import json
import math
import sys
import time

import mitsuba as mi
import numpy as np

from scene_file import SceneFile, cpu_seconds, matrix, rgb

SUN = 1e4  # metres


def spectrum(color):
    """A colour of the scene file, a list or one number."""
    return {"type": "rgb", "value": rgb(color)}


def stored(path):
    """An image's values as they are stored."""
    return np.array(mi.Bitmap(path))


class Translation(SceneFile):
    """A scene file as a dictionary of Mitsuba's."""

    def __init__(self, folder, sampler, percent=100):
        super().__init__(folder, percent)
        self.sampler = sampler

    def scene(self):
        """All of it."""
        panes = any("mix" in material for material in self.file["materials"].values())
        # Depth 2 is what Blender counts as no bounce: direct light.
        scene = {"type": "scene", "sensor": self.sensor(), "integrator": {
            "type": "volpath" if panes else "path", "max_depth": self.bounces + 2,
            "hide_emitters": any("point" in light for light in self.file.get("lights", []))}}
        world = self.world()
        if world:
            scene["world"] = self.background(*world)
        for index, light in enumerate(self.lights()):
            scene[f"light{index}"] = self.lamp(*light)
        for index, entry in enumerate(self.file["objects"]):
            scene[f"object{index}"] = {
                "type": "obj", "filename": self.path(self.file["meshes"][entry["mesh"]]),
                "to_world": mi.ScalarTransform4f(matrix(entry)),
                "bsdf": self.bsdf(entry["material"]),
            }
        return scene

    def sensor(self):
        """Blender's camera looks along −z, Mitsuba's along +z with x to the left."""
        return {
            "type": "perspective", "fov_axis": "larger", "fov": self.fov,
            "to_world": mi.ScalarTransform4f(matrix(self.file["camera"]) @ np.diag([-1.0, 1.0, -1.0, 1.0])),
            "film": {"type": "hdrfilm", "width": self.width, "height": self.height,
                     "pixel_format": "rgb", "component_format": "float32", "rfilter": {"type": "box"}},
            "sampler": {"type": self.sampler},
        }

    def background(self, kind, what, rotation=None):
        """A constant or an environment map."""
        if kind == "constant":
            return {"type": "constant", "radiance": spectrum(what)}
        # Blender looks d' = R·d up at u = 1/2 − atan2(d'y, d'x)/2π, Mitsuba its
        # local direction at u = atan2(x, −z)/2π: x, y, z are d'y, d'z, d'x.
        axes = np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0]], dtype=np.float64)
        to_world = np.eye(4)
        to_world[:3, :3] = (axes @ rotation).T
        return {"type": "envmap", "filename": self.path(what), "scale": what["strength"],
                "to_world": mi.ScalarTransform4f(to_world)}

    @staticmethod
    def lamp(kind, place, radiance, sizes):
        """A shape that shines: a rectangle or a disk along the light's −z, or a sphere."""
        emitter = {"type": "area", "radiance": spectrum(radiance)}
        if kind == "point":
            return {"type": "sphere", "center": place[:3, 3].tolist(), "radius": sizes, "emitter": emitter}
        turn = np.diag([1.0, -1.0, -1.0, 1.0])
        if kind == "area":
            size = np.diag([sizes[0] / 2.0, sizes[1] / 2.0, 1.0, 1.0])
            return {"type": "rectangle", "to_world": mi.ScalarTransform4f(place @ turn @ size), "emitter": emitter}
        far = place.copy()
        far[:3, 3] = SUN * place[:3, 2]
        size = SUN * math.tan(sizes)
        return {"type": "disk", "to_world": mi.ScalarTransform4f(far @ turn @ np.diag([size, size, 1.0, 1.0])),
                "emitter": emitter}

    def bsdf(self, name):
        """Lambert, single-scattering GGX, Disney's, or a pane."""
        (kind, keys), = self.file["materials"][name].items()
        if kind == "diffuse":
            return {"type": "diffuse", "reflectance": spectrum(keys["color"])}
        if kind == "mix":
            return {"type": "thindielectric", "int_ior": keys["factor"]["fresnel"]["ior"], "ext_ior": 1.0}
        if kind == "principled":
            return {"type": "twosided", "bsdf": {
                "type": "principled", "base_color": self.texture(keys.get("base_color", 0.8), spectrum),
                "roughness": self.texture(keys.get("roughness", 0.5), float), "metallic": float(keys.get("metallic", 0.0)),
                "specular": 0.5}}
        alpha_u, alpha_v = self.alphas(keys, stored)
        if kind == "conductor":
            if "rotation" in keys:
                print(f"{name}: the rotation of the tangent is left out")
            if np.ndim(alpha_u):
                alpha_u, alpha_v = (self.bitmap(keys["roughness"], values, True) for values in (alpha_u, alpha_v))
            return {"type": "roughconductor", "material": "none", "distribution": "ggx",
                    "alpha_u": alpha_u, "alpha_v": alpha_v, "specular_reflectance": spectrum(keys["color"])}
        assert kind == "dielectric", kind
        color = spectrum(keys.get("color", 1.0))
        return {"type": "roughdielectric", "distribution": "ggx", "alpha": alpha_u,
                "int_ior": keys["ior"], "ext_ior": 1.0,
                "specular_reflectance": color, "specular_transmittance": color}

    def texture(self, value, constant):
        """A value that may be a texture."""
        if not isinstance(value, dict):
            return constant(value)
        entry = self.file["textures"][value["texture"]]
        if entry["color_space"] == "srgb":
            return self.bitmap(value, stored(self.path(entry)), False)
        return self.bitmap(value, self.number(value, stored), True)

    def bitmap(self, value, values, raw):
        """Pixels where a texture's would be; `raw`: not to be decoded."""
        values = values[:, :, None].astype(np.float32) if raw else values
        return {"type": "bitmap", "raw": raw, "filter_type": "bilinear", "wrap_mode": "repeat",
                "bitmap": mi.Bitmap(values), "to_uv": mi.ScalarTransform3f().scale(self.scale(value))}


def main(folder, jobs, results, variant, sampler):
    """Every job in turn."""
    mi.set_variant(variant)
    import drjit as dr

    with open(jobs, encoding="utf-8") as file:
        jobs = json.load(file)
    scene = mi.load_dict(Translation(folder, sampler, jobs[0].get("percent", 100)).scene())

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
