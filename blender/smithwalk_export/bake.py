"""Which sockets are baked, over what, and what came out.

A value that varies in a way the scene format has no word for is baked by
Cycles. Where it depends on UVs alone it is baked over the square of UVs, and
every object may share it; else over the unwrapped surface of its object,
which then has the unwrapping's UVs beside its own.
"""

import contextlib
import hashlib
from dataclasses import dataclass, field

import numpy as np

from . import cycles
from .meshes import Arrays
from .nodes import dependencies, uv_map_names

_UNIFORM = 2e-4  # images that vary less, relative to their largest value, are written as constants
_LARGEST = 2 ** 13


@dataclass
class Needs:
    """What a material asks to be baked: {request: what its value depends on}."""

    requests: dict = field(default_factory=dict)

    @property
    def surface(self):
        """Whether something depends on more than UVs."""
        return any(d & {"surface", "instance"} for d in self.requests.values())

    @property
    def instance(self):
        """Whether something depends on the object as a whole, or where it stands."""
        return any("instance" in d for d in self.requests.values())

    @property
    def mapped(self):
        """Whether values need not repeat with the unit square of UVs."""
        return any("mapped" in d for d in self.requests.values())


class Recorder:
    """Stands in for results while the needs of a material are found."""

    def __init__(self):
        self.needs = Needs()

    def value(self, socket, groups, whole=False):
        """Records a request; None, as if nothing could be baked."""
        depends = dependencies_of(socket, groups, whole)
        if not depends & {"view"}:
            self.needs.requests[request(socket, groups, whole)] = depends
        return None


def dependencies_of(socket, groups, whole):
    """As `nodes.dependencies`; for a whole node, of all its inputs."""
    if not whole:
        return dependencies(socket, groups)
    return set().union(*(dependencies(s, groups) for s in socket.node.inputs if s.enabled))


def request(socket, groups, whole=False):
    """What names a socket within a material, copies of it included."""
    return (tuple(g.name for g in groups), socket.node.name, None if whole else socket.identifier)


@dataclass
class Site:
    """Where requests are baked: over a square of UVs, or over one surface."""

    key: str
    bounds: tuple = (0.0, 0.0, 1.0, 1.0)
    uv: object = None          # of a surface: UVs per loop
    results: dict = field(default_factory=dict)  # (material name, request) → array or constant


class Baker:
    """Bakes, or takes from the cache, what the objects of a scene ask for."""

    def __init__(self, size, enabled, log, progress):
        self.size = size
        self.enabled = enabled
        self.log = log
        self.progress = progress
        self.cache = cycles.Cache()
        self.sites = {}     # key → Site
        self._jobs = []     # baked after the depsgraph was handed over

    # Planning, while a depsgraph is at hand

    def plan(self, ob, matrix, materials, needs, depsgraph):
        """Register what an evaluated object's materials need (lists by slot in use)."""
        if any(n.surface for n in needs):
            key, arrays = self._surface_key(ob, materials, needs, matrix)
            if key not in self.sites:
                self.sites[key] = Site(key)
                self._jobs.append(self._surface_job(ob, matrix, materials, needs, key, arrays, depsgraph))
            return
        for material, need in zip(materials, needs):
            if need.requests:
                bounds = self._bounds(ob, need)
                key = self._square_key(material, bounds)
                if key not in self.sites:
                    self.sites[key] = Site(key, bounds)
                    self._jobs.append(self._square_job(material, need, key, bounds))

    @staticmethod
    def _bounds(ob, need):
        if not need.mapped or not ob.data.uv_layers:
            return (0.0, 0.0, 1.0, 1.0)
        layer = next((l for l in ob.data.uv_layers if l.active_render), ob.data.uv_layers[0])
        uv = np.empty(len(layer.data) * 2, dtype=np.float32)
        layer.data.foreach_get("uv", uv)
        uv = uv.reshape(-1, 2)
        uv = uv[np.isfinite(uv).all(axis=1)]
        if not len(uv):
            return (0.0, 0.0, 1.0, 1.0)
        low, high = np.floor(uv.min(axis=0) + 1e-4), np.ceil(uv.max(axis=0) - 1e-4)
        high = np.maximum(high, low + 1.0)
        return (float(low[0]), float(low[1]), float(high[0]), float(high[1]))

    def _square_key(self, material, bounds):
        return self.cache.key("square", self.size, bounds, material.name_full,
                              cycles.fingerprint(material.node_tree))

    def _surface_key(self, ob, materials, needs, matrix):
        mesh = ob.to_mesh()
        try:
            arrays = Arrays(mesh)
            attributes = _attributes(mesh)
        finally:
            ob.to_mesh_clear()
        parts = ["surface", self.size, arrays.digest().hex(), attributes, _texture_space(ob)]
        parts += [(m.name_full + cycles.fingerprint(m.node_tree)) if m and m.node_tree else "" for m in materials]
        if any(n.instance for n in needs):
            parts += [tuple(map(tuple, matrix)), tuple(ob.color), ob.pass_index, ob.name]
        return self.cache.key(*parts), arrays

    def _surface_job(self, ob, matrix, materials, needs, key, arrays, depsgraph):
        import bpy
        originals = [m.original if m else None for m in materials]
        if self.cache.get(key) is not None or not self.enabled:
            mesh = None
        else:
            mesh = bpy.data.meshes.new_from_object(ob, preserve_all_data_layers=True, depsgraph=depsgraph)
            mesh.name = "smithwalk bake"
            if ob.original.data and hasattr(ob.original.data, "texspace_location"):
                location, size = _texture_space(ob)
                for name in ("use_auto_texspace", "auto_texspace"):
                    if hasattr(mesh, name):
                        setattr(mesh, name, False)
                mesh.texspace_location, mesh.texspace_size = location, size
        original, name = ob.original, ob.name
        color, index, count = tuple(ob.color), ob.pass_index, max(len(ob.data.materials), 1)
        slots = arrays.slots

        def look(copy):
            copy.color, copy.pass_index, copy.name = color, index, name

        def run():
            asked = [list(n.requests) for n in needs]
            passes = []
            for i in range(max(map(len, asked))):
                row = [(None, None)] * count
                for slot, material, requests in zip(slots, originals, asked):
                    row[slot] = (material, requests[i] if i < len(requests) else None)
                passes.append(row)
            stored = self.cache.get(key)
            if stored is None and mesh is not None:
                with _without_name(original):
                    images, uv = cycles.bake(mesh, matrix, look, passes, self.size)
                stored = {f"image{i}": im.astype(np.float32) for i, im in enumerate(images)} | {"uv": uv}
                self.cache.put(key, **stored)
            if mesh is not None:
                bpy.data.meshes.remove(mesh)
            if stored is None:
                return
            site = self.sites[key]
            site.uv = stored["uv"]
            for material, requests in zip(originals, asked):
                for i, r in enumerate(requests):
                    site.results[material.name_full, r] = stored[f"image{i}"]
        return ob.name, run

    def _square_job(self, material, need, key, bounds):
        original = material.original
        names = [n for n in sorted(uv_map_names(material.node_tree))]

        def run():
            import bpy
            requests = list(need.requests)
            stored = self.cache.get(key)
            if stored is None and self.enabled:
                mesh = cycles.square(bounds, names)
                try:
                    from mathutils import Matrix
                    images, _ = cycles.bake(mesh, Matrix(), lambda ob: None,
                                            [[(original, r)] for r in requests],
                                            self._square_size(original.node_tree, bounds), unwrap=False)
                finally:
                    bpy.data.meshes.remove(mesh)
                stored = {f"image{i}": im.astype(np.float32) for i, im in enumerate(images)}
                self.cache.put(key, **stored)
            if stored is not None:
                for i, r in enumerate(requests):
                    self.sites[key].results[original.name_full, r] = stored[f"image{i}"]
        return original.name, run

    def _square_size(self, tree, bounds):
        """Four texels for each of the largest image below, within bounds."""
        largest = max((max(i.size) for i in _images(tree)), default=0)
        repeats = max(bounds[2] - bounds[0], bounds[3] - bounds[1])
        wanted = 4 * largest * repeats if largest else self.size
        return int(min(max(wanted, 256), max(self.size, min(largest, _LARGEST))))

    # Baking, between two depsgraphs

    def run(self):
        """Bake everything that was planned; failures are told and leave their values unbaked."""
        jobs, self._jobs = self._jobs, []
        for i, (name, job) in enumerate(jobs):
            self.progress(f"baking {name}", i / len(jobs))
            try:
                job()
            except (RuntimeError, StopIteration, KeyError, ValueError) as error:
                self.log.warn(f'"{name}"', f"can't be baked: {str(error).strip()[:200]}")

    # Results, while the scene is written

    def site(self, ob, matrix, materials, needs):
        """The sites of an object's slots: (list of Site or None, UVs of a surface or None)."""
        if any(n.surface for n in needs):
            key, _ = self._surface_key(ob, materials, needs, matrix)
            site = self.sites.get(key)
            if site is None or site.uv is None:
                return [None] * len(materials), None
            return [site] * len(materials), site.uv
        return [self.sites.get(self._square_key(m, self._bounds(ob, n))) if n.requests else None
                for m, n in zip(materials, needs)], None


@contextlib.contextmanager
def _without_name(ob):
    """Lends an object's name to its copy: Cycles' random number of an object is a hash of it."""
    name = ob.name
    if ob.library is None:
        ob.name = "smithwalk original"
    try:
        yield
    finally:
        if ob.library is None:
            ob.name = name


def _images(tree):
    for node in tree.nodes:
        image = getattr(node, "image", None)
        if image is not None:
            yield image
        if node.type == "GROUP" and node.node_tree:
            yield from _images(node.node_tree)


def _texture_space(ob):
    data = ob.original.data
    if data is None or not hasattr(data, "texspace_location"):
        return None
    return tuple(data.texspace_location), tuple(data.texspace_size)


def _attributes(mesh):
    """A hash of the colour attributes and named UV maps."""
    sums = []
    for layer in mesh.color_attributes:
        values = np.empty(len(layer.data) * 4, dtype=np.float32)
        layer.data.foreach_get("color", values)
        sums.append((layer.name, hashlib.sha256(values.tobytes()).hexdigest()))
    return sums


def uniform(image):
    """The one value of an image that has the same everywhere, else None."""
    low, high = image.min(axis=(0, 1)), image.max(axis=(0, 1))
    if (high - low).max() <= _UNIFORM * max(float(np.abs(high).max()), 1e-6):
        return tuple(float(c) for c in (low + high) / 2.0)
    return None
