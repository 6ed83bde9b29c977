"""Evaluated meshes to OBJ files.

Positions are object space, metres, z up. Every polygon is written as
Blender's own triangles (a renderer's fan would differ on concave n-gons),
with split normals, so that flat, smooth, auto-smooth and custom normals all
arrive as they are. Positions and UVs have nine significant digits, with which
a float32 survives exactly; normals, directions, have five decimals.
"""

import hashlib
import os
import re

import numpy as np

_LINES = 100_000  # formatted at a time: bounds the memory of the text


def unique_name(name, taken):
    """A portable name made from a Blender name, different from all in `taken`."""
    stem = re.sub(r"[^A-Za-z0-9_-]+", "_", name).strip("_").lower() or "unnamed"
    candidate, n = stem, 2
    while candidate in taken:
        candidate, n = f"{stem}_{n}", n + 1
    return candidate


class MeshWriter:
    """Writes each distinct evaluated mesh once, and remembers its name."""

    def __init__(self, files, log):
        self.files = files     # where files go (files.Folder)
        self.log = log
        self.meshes = {}       # mesh name → file name
        self._by_hash = {}     # hash of the arrays → mesh name
        self._by_key = {}      # evaluated data, UVs, transform → (mesh name, used slots) or None

    def add(self, ob, uv=None, transform=None, progress=None):
        """The mesh name and the used material slots of an evaluated object.

        None when the object has no faces. Objects that share evaluated data
        (instances, linked duplicates) share the file. `uv` takes the place of
        the active UV map (one row per loop); `transform` moves the vertices.
        """
        key = (ob.data.as_pointer(), id(uv) if uv is not None else None,
               tuple(map(tuple, transform)) if transform is not None else None)
        if key not in self._by_key:
            self._by_key[key] = self._write(ob, uv, transform, progress)
        return self._by_key[key]

    def _write(self, ob, uv, transform, progress):
        mesh = ob.to_mesh()
        if mesh is None:
            return None
        try:
            if not mesh.polygons:
                return None
            arrays = Arrays(mesh, uv, transform)
        finally:
            ob.to_mesh_clear()
        if arrays.left_out:
            self.log.note(f'object "{ob.name}"', f"{arrays.left_out} triangle(s) with a vertex that is not "
                                                 "finite are left out")
        if not arrays.slots:
            return None
        digest = arrays.digest()
        name = self._by_hash.get(digest)
        if name is None:
            # Evaluated data has names of its own in some versions.
            name = self._by_hash[digest] = unique_name(ob.original.data.name, self.meshes)
            path, file = self.files.new(f"{name}.obj")
            self.meshes[name] = file
            with open(path, "w", encoding="ascii") as f:
                arrays.write(f, progress)
        return name, arrays.slots


def _floats(collection, attribute, width, count):
    values = np.empty(count * width, dtype=np.float32)
    collection.foreach_get(attribute, values)
    return values.reshape(count, width)


def _integers(collection, attribute, count):
    values = np.empty(count, dtype=np.int32)
    collection.foreach_get(attribute, values)
    return values


def _corner_normals(mesh):
    count = len(mesh.loops)
    if hasattr(mesh, "calc_normals_split"):  # until 4.0
        mesh.calc_normals_split()
        return _floats(mesh.loops, "normal", 3, count)
    return _floats(mesh.corner_normals, "vector", 3, count)


def _distinct(rows):
    """Distinct rows of small integers and each row's index: through one 64-bit key per row."""
    low = rows.min(axis=0)
    span = [int(s) + 1 for s in (rows.max(axis=0) - low)]
    key = np.zeros(len(rows), dtype=np.int64)
    for column, width in zip((rows - low).T, span):
        key = key * width + column
    _, first, index = np.unique(key, return_index=True, return_inverse=True)
    return rows[first], index.reshape(-1)


class Arrays:
    """A mesh as an OBJ holds it: vertices, normals, UVs, triangles by slot."""

    def __init__(self, mesh, uv=None, transform=None):
        self.positions = _floats(mesh.vertices, "co", 3, len(mesh.vertices))
        normals = _corner_normals(mesh)
        if uv is None:
            layer = next((l for l in mesh.uv_layers if l.active_render), None)
            uv = _floats(layer.data, "uv", 2, len(mesh.loops)) if layer and len(layer.data) else None
        if transform is not None:
            matrix = np.array(transform, dtype=np.float64)
            self.positions = (self.positions @ matrix[:3, :3].T + matrix[:3, 3]).astype(np.float32)

        mesh.calc_loop_triangles()
        count = len(mesh.loop_triangles)
        loops = _integers(mesh.loop_triangles, "loops", count * 3).reshape(count, 3)
        vertices = _integers(mesh.loop_triangles, "vertices", count * 3).reshape(count, 3)
        slots = _integers(mesh.loop_triangles, "material_index", count)
        # Blender clamps the indices of faces whose slot was removed.
        slots = np.clip(slots, 0, max(len(mesh.materials) - 1, 0))

        finite = np.isfinite(self.positions).all(axis=1)
        self.left_out = 0
        if not finite.all():
            keep = finite[vertices].all(axis=1)
            self.left_out = int(count - keep.sum())
            loops, vertices, slots = loops[keep], vertices[keep], slots[keep]
            self.positions[~finite] = 0.0

        normals[~np.isfinite(normals).all(axis=1)] = 0.0
        grid = np.rint(normals * 1e5).astype(np.int64)
        flat_matrix = transform is not None and abs(np.linalg.det(np.array(transform)[:3, :3])) == 0.0
        if flat_matrix or not len(grid):
            self.normals = None
            normal_index = None
        else:
            rows, index = _distinct(grid)
            self.normals = rows * 1e-5
            normal_index = index[loops]
        self.uvs = None
        uv_index = None
        if uv is not None and len(uv):
            uv = np.where(np.isfinite(uv), uv, 0.0).astype(np.float32)
            # Two float32 side by side are one 64-bit key; + 0 makes −0 the same as 0.
            key = np.ascontiguousarray(uv + 0.0).view(np.int64).reshape(-1)
            _, first, index = np.unique(key, return_index=True, return_inverse=True)
            self.uvs, uv_index = uv[first], index.reshape(-1)[loops]

        columns = [vertices] + [i for i in (uv_index, normal_index) if i is not None]
        table = np.stack(columns, axis=2) + 1  # (triangle, corner, index kind), from 1
        self.slots = [int(s) for s in np.unique(slots)]
        self.faces = {s: table[slots == s].reshape(-1, 3 * len(columns)) for s in self.slots} \
            if len(self.slots) > 1 else {s: table.reshape(-1, 3 * len(columns)) for s in self.slots}
        corner = {(True, True): "%d/%d/%d", (True, False): "%d/%d", (False, True): "%d//%d",
                  (False, False): "%d"}[self.uvs is not None, self.normals is not None]
        self._face = f"f {corner} {corner} {corner}\n"

    def digest(self):
        """A hash of all that the file would hold."""
        sha = hashlib.sha256(self._face.encode())
        for array in (self.positions, self.normals, self.uvs, *self.faces.values()):
            sha.update(b"" if array is None else np.ascontiguousarray(array).tobytes())
        sha.update(str(self.slots).encode())
        return sha.digest()

    def write(self, out, progress=None):
        """The OBJ. Faces of slot n stand under `usemtl slot_n` when more than one is used."""
        total = len(self.positions) + sum(map(len, self.faces.values()))
        done = 0
        for rows, line in ((self.positions, "v %.9g %.9g %.9g\n"), (self.uvs, "vt %.9g %.9g\n"),
                           (self.normals, "vn %.5g %.5g %.5g\n")):
            if rows is not None:
                for chunk in _format(out, rows, line):
                    done += chunk
                    if progress:
                        progress(done / total)
        for slot in self.slots:
            if len(self.slots) > 1:
                out.write(f"usemtl slot_{slot}\n")
            for chunk in _format(out, self.faces[slot], self._face):
                done += chunk
                if progress:
                    progress(min(done / total, 1.0))


def _format(out, rows, line):
    """Write a line per row, many at a time; yields how many."""
    for start in range(0, len(rows), _LINES):
        chunk = rows[start:start + _LINES]
        if chunk.dtype == np.float32:
            chunk = chunk + np.float32(0.0)  # −0 to 0
        out.write(line * len(chunk) % tuple(chunk.ravel().tolist()))
        yield len(chunk)
