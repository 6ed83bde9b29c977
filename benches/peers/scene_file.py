"""Scene files for the renderers of race.py: what their workers share.

As far as the scenes of the race need it: values as numbers and arrays, light as
radiance, meshes as arrays. Needs numpy and PyYAML, and what reads an image.
"""

import math
import os
import resource

import numpy as np
import yaml


def cpu_seconds():
    """Of all threads of this process."""
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def rgb(color, factor=1.0):
    """A colour of the scene file, a list or one number, times `factor`: three numbers."""
    return [factor * float(c) for c in (color if isinstance(color, list) else [color] * 3)]


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


class SceneFile:
    """A scene file, and what its words mean."""

    def __init__(self, folder, percent=100):
        self.folder = folder
        with open(os.path.join(folder, "scene.yaml"), encoding="utf-8") as file:
            self.file = yaml.safe_load(file)
        film = self.file["film"]
        self.width, self.height = (film[side] * percent // 100 for side in ("width", "height"))
        self.bounces = self.file["sampling"]["max_bounces"]
        lens = self.file["camera"]["projection"]["perspective"]
        self.fov = 2.0 * math.degrees(math.atan(lens["sensor_width"] / (2.0 * lens["lens"])))  # the larger side's

    def path(self, entry):
        """The file that a mesh, a texture or the world names."""
        return os.path.join(self.folder, entry["file"])

    def world(self):
        """("constant", radiance), ("environment", its entry, rotation 3 × 3) or None if black."""
        (kind, world), = self.file.get("world", {"constant": {"color": 0.0}}).items()
        if kind == "environment":
            return kind, world, euler(world.get("rotation", [0.0, 0.0, 0.0]))
        radiance = rgb(world["color"], world.get("strength", 1.0))
        return (kind, radiance) if any(radiance) else None

    def lights(self):
        """(kind, place 4 × 4, radiance, sizes): `area` has width and height, `point` a radius, `sun` a half angle."""
        for light in self.file.get("lights", []):
            (kind, keys), = light.items()
            color = keys.get("color", 1.0)
            if kind == "area":
                shape = keys["shape"]["rectangle"]
                per_area = 4.0 if self.file.get("light_units") == "cycles_3" else math.pi
                radiance = keys["power"] / (per_area * shape["width"] * shape["height"])
                sizes = shape["width"], shape["height"]
            elif kind == "point":
                radiance, sizes = keys["power"] / (2.0 * math.pi * keys["radius"]) ** 2, keys["radius"]
            else:
                sizes = math.radians(keys["angle"]) / 2.0
                radiance = keys["strength"] / (math.pi * math.sin(sizes) ** 2)
            yield kind, matrix(keys), rgb(color, radiance), sizes

    def alphas(self, keys, read):
        """α along u and v from roughness and anisotropy (0 to 1), numbers or arrays."""
        roughness = self.number(keys["roughness"], read)
        anisotropy = self.number(keys.get("anisotropy", 0.0), read)
        alpha = roughness ** 2
        return alpha * (1.0 - anisotropy), np.minimum(alpha / np.maximum(1.0 - anisotropy, 1e-6), 1.0)

    def number(self, value, read):
        """A number, or the first channel of a texture as it is stored, by `read(path)`."""
        if not isinstance(value, dict):
            return value
        pixels = read(self.path(self.file["textures"][value["texture"]])).astype(np.float64) / 255.0
        return pixels if pixels.ndim == 2 else pixels[:, :, 0]

    def scale(self, value):
        """How often a texture repeats along u and v."""
        return self.file["textures"][value["texture"]].get("scale", [1.0, 1.0])


def triangles(path):
    """An OBJ file as points, normals and UVs (or None) of vertices, and triangles of their indices: lists."""
    columns, vertices, faces = {"v": [], "vt": [], "vn": []}, {}, []
    with open(path, encoding="utf-8") as file:
        for line in file:
            word, *rest = line.split() or [""]
            if word in columns:
                columns[word].append([float(x) for x in rest])
            elif word == "f":
                corners = [vertices.setdefault(corner, len(vertices)) for corner in rest]
                faces += [(corners[0], *corners[k:k + 2]) for k in range(1, len(corners) - 1)]
    indices = [(corner + "//").split("/")[:3] for corner in vertices]
    points, uvs, normals = (
        [columns[word][int(index[at]) - 1] for index in indices] if columns[word] else None
        for at, word in enumerate(("v", "vt", "vn")))
    return points, normals, uvs, faces
