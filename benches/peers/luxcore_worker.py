"""Renders jobs with LuxCore; a worker of race.py.

    python3 benches/peers/luxcore_worker.py SCENE_DIR JOBS.json RESULTS.json

Path tracing on the CPU, Sobol's sequence, all other settings as they come; as far
as the scenes of the race need it. What differs: LuxCore scatters once; metals
(`metal2`, `disney`) and glass have Schlick's masking, and metals an index of
refraction that gives the colour at normal incidence; `disney` stands for Blender's
Principled node, `archglass` for panes; the tangent's rotation is left out; lamps are
found by light samples alone and not seen. Times are from the start of a session to its
last sample, less those of a session of a few pixels. Needs numpy, PyYAML, and Pillow for textures.
"""

import json
import math
import os
import sys
import time

import numpy as np
import pyluxcore

from scene_file import SceneFile, cpu_seconds, matrix, rgb, triangles


def stored(path):
    """An image's values as they are stored."""
    from PIL import Image

    return np.array(Image.open(path))


def column_major(transform):
    """A 4 × 4 array as LuxCore lists it."""
    return np.asarray(transform).T.ravel().tolist()


class Translation(SceneFile):
    """A scene file as LuxCore's properties."""

    def __init__(self, folder, percent):
        super().__init__(folder, percent)
        self.scene, self.properties = pyluxcore.Scene(), {}

    def build(self):
        """All of it."""
        self.camera()
        world = self.world()
        if world:
            self.background(*world)
        for name in self.file["materials"]:
            self.material(name)
        for name, entry in self.file["meshes"].items():
            points, normals, uvs, faces = triangles(self.path(entry))
            points, normals, uvs = (values and [tuple(value) for value in values] for values in (points, normals, uvs))
            self.scene.DefineMesh(name, points, faces, normals, uvs, None, None)
        for index, entry in enumerate(self.file["objects"]):
            self.put(f"objects.object{index}", shape=entry["mesh"], material=entry["material"],
                     transformation=column_major(matrix(entry)))
        for index, light in enumerate(self.lights()):
            self.lamp(f"lamp{index}", *light)
        self.scene.Parse(properties(self.properties))
        return self.scene

    def put(self, where, **keys):
        """Properties of one thing; `__` stands for a dot."""
        for key, value in keys.items():
            self.properties[f"scene.{where}.{key.replace('__', '.')}"] = value

    def camera(self):
        """The view axis is −z; ± 1 on the screen is the wider side."""
        place = matrix(self.file["camera"])
        shape = self.height / self.width
        self.put("camera", type="perspective", lookat__orig=place[:3, 3].tolist(),
                 lookat__target=(place[:3, 3] - place[:3, 2]).tolist(), up=place[:3, 1].tolist(), fieldofview=self.fov,
                 screenwindow=[-1.0, 1.0, -shape, shape], autofocus__enable=False)

    def background(self, kind, what, rotation=None):
        """A constant or an environment map."""
        if kind == "constant":
            self.put("lights.world", type="constantinfinite", color=what)
            return
        # Blender looks d' = R·d up at u = 1/2 − atan2(d'y, d'x)/2π, LuxCore its local
        # direction at u = atan2(y, x)/2π: x and y are −d'x and d'y.
        to_world = np.eye(4)
        to_world[:3, :3] = (np.diag([-1.0, 1.0, 1.0]) @ rotation).T
        self.put("lights.world", type="infinite", file=self.path(what), gamma=1.0, gain=rgb(what["strength"]),
                 transformation=column_major(to_world))

    def lamp(self, name, kind, place, radiance, sizes):
        """A quadrilateral that shines on its front, a sphere, or a cone of directions."""
        if kind == "area":
            corners = [(x * sizes[0] / 2.0, y * sizes[1] / 2.0, 0.0) for x, y in ((-1, -1), (-1, 1), (1, 1), (1, -1))]
            self.scene.DefineMesh(name, corners, [(0, 1, 2), (0, 2, 3)], None, None, None, None)
            self.put(f"materials.{name}", type="matte", kd=[0.0, 0.0, 0.0], emission=radiance)
            self.put(f"objects.{name}", shape=name, material=name, transformation=column_major(place), camerainvisible=True)
        elif kind == "point":
            # Of a sphere light LuxCore makes the radiance by 1/(4π² r²).
            self.put(f"lights.{name}", type="sphere", position=place[:3, 3].tolist(), radius=sizes,
                     gain=[c * (2.0 * math.pi * sizes) ** 2 for c in radiance])
        else:
            self.put(f"lights.{name}", type="distant", direction=(-place[:3, 2]).tolist(), theta=math.degrees(sizes),
                     gain=radiance)

    def material(self, name):
        """What is nearest among LuxCore's materials."""
        (kind, keys), = self.file["materials"][name].items()
        where = f"materials.{name}"
        if kind == "diffuse":
            self.put(where, type="matte", kd=rgb(keys["color"]))
        elif kind == "mix":
            self.put(where, type="archglass", kr=rgb(1.0), kt=rgb(1.0), interiorior=keys["factor"]["fresnel"]["ior"])
        elif kind == "principled":
            self.put(where, type="disney", basecolor=self.texture(keys.get("base_color", 0.8), rgb),
                     roughness=self.texture(keys.get("roughness", 0.5), float), metallic=float(keys.get("metallic", 0.0)),
                     specular=0.5)
        elif kind == "conductor":
            if "rotation" in keys:
                print(f"{name}: the rotation of the tangent is left out")
            along, across = self.alphas(keys, stored)
            if np.ndim(along):
                along, across = (self.image(keys["roughness"], f"{name}_{axis}", values)
                                 for axis, values in zip("uv", (along, across)))
            self.put(f"textures.{name}_color", type="fresnelcolor", kr=rgb(keys["color"]))
            self.put(where, type="metal2", fresnel=f"{name}_color", uroughness=along, vroughness=across)
        else:
            assert kind == "dielectric", kind
            alpha, color = self.alphas(keys, stored)[0], rgb(keys.get("color", 1.0))
            self.put(where, type="roughglass", kr=color, kt=color, interiorior=keys["ior"], uroughness=float(alpha),
                     vroughness=float(alpha))

    def texture(self, value, constant):
        """A value that may be a texture."""
        if not isinstance(value, dict):
            return constant(value)
        entry = self.file["textures"][value["texture"]]
        if entry["color_space"] != "srgb":
            return self.image(value, value["texture"], self.number(value, stored))
        coded = stored(self.path(entry)).astype(np.float64) / 255.0
        return self.image(value, value["texture"], np.where(
            coded <= 0.04045, coded / 12.92, ((coded + 0.055) / 1.055) ** 2.4))

    def image(self, value, name, values):
        """Pixels where a texture's would be; the name of a texture."""
        height, width = values.shape[:2]
        channels = values.shape[2] if values.ndim == 3 else 1
        self.scene.DefineImageMap(name, np.ascontiguousarray(values, dtype=np.float32), 1.0, channels, width, height)
        across, up = self.scale(value)
        self.put(f"textures.{name}", type="imagemap", file=name, gamma=1.0, mapping__type="uvmapping2d",
                 mapping__uvscale=[across, -up], mapping__uvdelta=[0.0, 1.0])
        return name


def properties(values):
    """LuxCore's own container."""
    found = pyluxcore.Properties()
    for key, value in values.items():
        found.Set(pyluxcore.Property(key, value))
    return found


def render(translation, scene, job):
    """A session that has ended, wall and CPU seconds."""
    depth = translation.bounces + 1  # direct light is a depth of 1
    session = pyluxcore.RenderSession(pyluxcore.RenderConfig(properties({
        "renderengine.type": "PATHCPU", "renderengine.seed": job["seed"], "sampler.type": "SOBOL",
        "path.pathdepth.total": depth, "path.pathdepth.diffuse": depth, "path.pathdepth.glossy": depth,
        "path.pathdepth.specular": depth, "film.width": job["width"], "film.height": job["height"],
        "film.filter.type": "NONE", "batch.haltspp": [job["spp"], 0],
    }), scene))
    wall, cpu = time.monotonic(), cpu_seconds()
    session.Start()
    while not session.HasDone():
        time.sleep(0.01)
        session.UpdateStats()
    session.Stop()
    return session, time.monotonic() - wall, cpu_seconds() - cpu


def main(folder, jobs, results):
    """Every job in turn."""
    pyluxcore.Init()
    with open(jobs, encoding="utf-8") as file:
        jobs = json.load(file)
    translation = Translation(folder, jobs[0].get("percent", 100))
    scene = translation.build()
    few = {"seed": 1, "spp": 1, "width": 8, "height": 6}
    # The second time, when what is done once is done.
    before = [render(translation, scene, few)[1:] for _ in range(2)][1]
    measured = []
    for job in jobs:
        job.update(width=translation.width, height=translation.height)
        session, wall, cpu = render(translation, scene, job)
        session.GetFilm().SaveOutput(job["out"], pyluxcore.FilmOutputType.RGB, properties({}))
        measured.append({"wall_s": wall - before[0], "cpu_s": cpu - before[1]})
    with open(results, "w", encoding="utf-8") as file:
        json.dump({"version": f"LuxCore {pyluxcore.Version()}", "results": measured}, file)


if __name__ == "__main__":
    main(*sys.argv[1:])
    sys.stdout.flush()
    os._exit(0)  # the module crashes when the interpreter takes it down
