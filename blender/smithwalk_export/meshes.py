"""Evaluated meshes to OBJ files.

Positions are object space, metres, z up. Every polygon is written as
Blender's own triangles (a renderer's fan would differ on concave n-gons),
with split normals, so that flat, smooth, auto-smooth and custom normals all
arrive as they are. Positions and UVs have nine significant digits, with which
a float32 survives exactly; normals, directions, are written
in steps of 1e-5.
"""

import hashlib
import os
import re

import numpy as np

from . import text

BAKED = "baked"     # the UV map that baked images are on
FARTHEST = 1e18    # metres: squares of larger coordinates leave single precision
_FACES = 100_000  # looked at together: bounds the memory
LEAN = 25.0        # degrees between a corner's normal and its face's, from which Cycles looks otherwise


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
        self.meshes = {}       # mesh name → its entry in the scene
        self._names = {}       # identity of the arrays, from `_same` → mesh name
        self._first = {}       # quick signature → [identity, arrays until a second mesh has the same one]
        self._by_key = {}      # evaluated data, what is asked of it, transform → (mesh name, used slots) or None

    def add(self, ob, uv_maps=(), colors=(), baked=None, needs_uv=False, transform=None, progress=None):
        """The mesh name and the used material slots of an evaluated object.

        None when the object has no faces. Objects that share evaluated data
        (instances, linked duplicates) share the file. `uv_maps` and `colors`
        are names of what is written beside the active UV map; `baked` are the
        UVs of bakes (one row per loop); with `needs_uv` a mesh without UVs has
        them at 0, as in Cycles; `transform` moves the vertices.
        """
        key = (ob.data.as_pointer(), tuple(sorted(uv_maps)), tuple(sorted(colors)),
               id(baked) if baked is not None else None, needs_uv,
               tuple(map(tuple, transform)) if transform is not None else None)
        if key not in self._by_key:
            self._by_key[key] = self._write(ob, key[1], key[2], baked, needs_uv, transform, progress)
        return self._by_key[key]

    def _same(self, arrays):
        """What equal arrays share. Only meshes that look alike at first glance are hashed."""
        signature = arrays.signature()
        entry = self._first.setdefault(signature, [signature, arrays])
        if entry[1] is arrays:
            return signature
        if isinstance(entry[1], Arrays):
            entry[1] = entry[1].digest()
        digest = arrays.digest()
        return signature if digest == entry[1] else digest

    def _write(self, ob, uv_maps, colors, baked, needs_uv, transform, progress):
        # As in Cycles, the evaluated data itself: a copy, unless the mesh is being edited, costs memory.
        edited = ob.mode == "EDIT"
        mesh = ob.to_mesh() if edited else ob.data
        if mesh is None:
            return None
        try:
            if not mesh.polygons:
                return None
            arrays = Arrays(mesh, transform, _sides(mesh, uv_maps, colors, baked), needs_uv)
        finally:
            if edited:
                ob.to_mesh_clear()
        if arrays.left_out:
            self.log.note(f'object "{ob.name}"', f"{arrays.left_out} face(s) with a vertex that is not "
                                                 "finite, or out of reach, are left out")
        if not arrays.slots:
            return None
        if arrays.leaning > 0.02:
            self.log.warn(f'object "{ob.name}"', f"smooth normals lean by up to {arrays.lean:.0f}° from faces of "
                          f"{100 * arrays.leaning:.0f} % of the area: light that Cycles loses or bends there is "
                          "kept, and goes elsewhere (shade smooth by angle would help both)")
        same = self._same(arrays)
        name = self._names.get(same)
        if name is None:
            # Evaluated data has names of its own in some versions.
            name = self._names[same] = unique_name(ob.original.data.name, self.meshes)
            path, file = self.files.new(f"{name}.obj")
            with open(path, "wb") as f:
                arrays.write(f, progress)
            entry = self.meshes[name] = {"file": file}
            for kind, side, values in arrays.sides:
                beside = file
                if values is not None:
                    path, beside = self.files.new(f"{name}_{unique_name(side, ())}.obj")
                    with open(path, "wb") as f:
                        arrays.write_side(f, kind, values)
                entry.setdefault(kind, {})[side] = beside
        return name, arrays.slots


def _floats(collection, attribute, width, count):
    values = np.empty(count * width, dtype=np.float32)
    collection.foreach_get(attribute, values)
    return values.reshape(count, width)


def _integers(collection, attribute, count):
    values = np.empty(count, dtype=np.int32)
    collection.foreach_get(attribute, values)
    return values


def _attribute(mesh, name, usual):
    """The data of a built-in attribute, which is quicker to read than what mirrors it (`usual`),
    and the name of its values. There are such attributes from 3.5 on."""
    attribute = mesh.attributes.get(name)
    if attribute is None:
        return usual
    return attribute.data, "vector" if attribute.data_type.startswith("FLOAT") else "value"


def _vertex_indices(mesh):
    data, name = _attribute(mesh, ".corner_vert", (mesh.loops, "vertex_index"))
    return _integers(data, name, len(mesh.loops))


def _active_uvs(mesh):
    """UVs per corner, or None."""
    layer = next((l for l in mesh.uv_layers if l.active_render), None)
    if layer is None or not len(layer.data):
        return None
    data, name = _attribute(mesh, layer.name, (layer.data, "uv"))
    return _floats(data, name, 2, len(mesh.loops))


def _sides(mesh, uv_maps, colors, baked):
    """What is written beside a mesh: (key of the format, name, values per corner). The
    values are None where the mesh's own file has them; what is missing is 0, as in Cycles."""
    count = len(mesh.loops)
    sides = []
    for name in uv_maps:
        layer = mesh.uv_layers.get(name)
        if layer is not None and layer.active_render:
            values = None
        elif layer is not None and len(layer.data):
            values = _finite(_floats(layer.data, "uv", 2, count))
        else:
            values = np.zeros((count, 2), dtype=np.float32)
        sides.append(("uv_maps", name, values))
    if baked is not None:
        sides.append(("uv_maps", BAKED, _finite(baked)))
    for name in colors:
        layer = mesh.color_attributes.get(name)
        if layer is None or not len(layer.data):
            values = np.zeros((count, 3), dtype=np.float32)
        else:
            values = _floats(layer.data, "color", 4, len(layer.data))[:, :3]
            if layer.domain == "POINT":
                values = values[_vertex_indices(mesh)]
        sides.append(("colors", name, _finite(values)))
    return sides


def _finite(values):
    return np.where(np.isfinite(values), values, 0.0).astype(np.float32)


def _corner_normals(mesh):
    count = len(mesh.loops)
    if hasattr(mesh, "calc_normals_split"):  # until 4.0
        mesh.calc_normals_split()
        normals = _floats(mesh.loops, "normal", 3, count)
        mesh.free_normals_split()
        return normals
    return _floats(mesh.corner_normals, "vector", 3, count)


def _lean(mesh, normals):
    """The largest angle between a corner's normal and its face's, degrees, and the share of
    the area of faces where it is above `LEAN`."""
    count = len(mesh.polygons)
    smooth = np.empty(count, dtype=bool)
    mesh.polygons.foreach_get("use_smooth", smooth)
    if not smooth.any():
        return 0.0, 0.0
    faces = _floats(mesh.polygons, "normal", 3, count)
    areas = _floats(mesh.polygons, "area", 1, count)[:, 0]
    starts = _integers(mesh.polygons, "loop_start", count)
    totals = np.diff(starts, append=len(normals))
    least = np.empty(count, dtype=np.float32)
    for first in range(0, count, _FACES):
        some = slice(first, first + _FACES)
        begin, end = starts[first], starts[some][-1] + totals[some][-1]
        cosines = np.einsum("ij,ij->i", np.repeat(faces[some], totals[some], axis=0), normals[begin:end])
        least[some] = np.minimum.reduceat(cosines, starts[some] - begin)
    least = np.where((areas > 0.0) & np.isfinite(areas), least, 1.0)
    lean = np.degrees(np.arccos(np.clip(least.min(), -1.0, 1.0)))
    leaning = least < np.cos(np.radians(LEAN))
    return float(lean), float(areas[leaning].sum() / max(np.nansum(areas), 1e-30))


def _indexed(keys, rows, vertex_of, count):
    """Distinct rows, and the row of each corner: one per vertex as far as its corners agree.

    `keys` holds one 64-bit number per corner that is the same where rows are.
    """
    first = np.zeros(count, dtype=np.int64)
    at = np.zeros(count, dtype=np.int32)
    first[vertex_of] = keys  # of a vertex's corners the last one counts
    at[vertex_of] = np.arange(len(keys), dtype=np.int32)
    odd = first[vertex_of] != keys
    share = np.count_nonzero(odd) / max(len(keys), 1)
    if share > 0.25:  # flat shading, say: rows per vertex would be for nothing
        _, where, index = np.unique(keys, return_index=True, return_inverse=True)
        return rows[where], index.reshape(-1)
    values, index = rows[at], vertex_of.copy()
    if share:
        _, where, more = np.unique(keys[odd], return_index=True, return_inverse=True)
        values = np.concatenate([values, rows[odd][where]])
        index[odd] = count + more.reshape(-1)
    return values, index


def _polygons(mesh, loop_count):
    """Polygons whose fan from the first corner is Blender's own triangulation stay whole.

    Returns (corners, loops, slots) per number of corners: loops is an array
    (polygon, corner) of loop indices.
    """
    count = len(mesh.polygons)
    starts = _integers(mesh.polygons, "loop_start", count)
    totals = np.diff(starts, append=loop_count)
    slots = np.zeros(count, dtype=np.int32)
    if len(mesh.materials) > 1:
        # Blender clamps the indices of faces whose slot was removed.
        slots = np.clip(_integers(mesh.polygons, "material_index", count), 0, len(mesh.materials) - 1)
    triangle_count = len(mesh.loop_triangles)
    triangles = _integers(mesh.loop_triangles, "loops", triangle_count * 3).reshape(-1, 3)
    polygons = getattr(mesh, "loop_triangle_polygons", None)
    owner = _integers(polygons, "value", triangle_count) if polygons is not None \
        else _integers(mesh.loop_triangles, "polygon_index", triangle_count)
    # A quad is a fan from its first corner if its triangles are (0, 1, 2) and
    # (0, 2, 3): the others, (0, 1, 3) and (1, 2, 3), have sums of their own.
    total = triangles.sum(axis=1, dtype=np.int32) - 3 * starts[owner]
    is_quad = totals == 4
    broken = np.zeros(count, dtype=bool)
    broken[owner[is_quad[owner] & (total != 3) & (total != 5)]] = True
    del total
    whole = is_quad & ~broken
    quads = starts[whole][:, None] + np.arange(4, dtype=np.int32)
    single = ~whole[owner]
    return [(quads, slots[whole]), (triangles[single], slots[owner[single]])]


class Arrays:
    """A mesh as an OBJ holds it: vertices, normals, UVs, faces by slot."""

    def __init__(self, mesh, transform=None, sides=(), needs_uv=False):
        count = len(mesh.vertices)
        self.sides = sides
        data, name = _attribute(mesh, "position", (mesh.vertices, "co"))
        self.positions = _floats(data, name, 3, count)
        uv = _active_uvs(mesh)
        if uv is None and needs_uv:
            uv = np.zeros((len(mesh.loops), 2), dtype=np.float32)
        if transform is not None:
            matrix = np.array(transform, dtype=np.float64)
            self.positions = (self.positions @ matrix[:3, :3].T + matrix[:3, 3]).astype(np.float32)
        vertex_of = _vertex_indices(mesh)
        mesh.calc_loop_triangles()
        polygons = _polygons(mesh, len(mesh.loops))

        finite = (np.abs(self.positions) <= FARTHEST).all(axis=1)  # false for NaN
        self.left_out = 0
        if not finite.all():
            kept = [(l, s, finite[vertex_of[l]].all(axis=1)) for l, s in polygons]
            self.left_out = int(sum((~k).sum() for _, _, k in kept))
            polygons = [(l[k], s[k]) for l, s, k in kept]
            self.positions[~finite] = 0.0

        # A mesh that its object's scale flattens has no normals that could be
        # brought to the scene: it is shaded flat, as it is.
        flattened = transform is not None
        self.normals = normal_index = None
        self.lean = self.leaning = 0.0
        if not flattened and len(vertex_of):
            normals = _corner_normals(mesh)
            normals[~np.isfinite(normals).all(axis=1)] = 0.0
            self.lean, self.leaning = _lean(mesh, normals)
            np.rint(np.multiply(normals, 1e5, out=normals), out=normals)
            keys = normals[:, 0].astype(np.int64)
            for i in (1, 2):
                keys *= 200_001
                keys += normals[:, i].astype(np.int64)
            self.normals, normal_index = _indexed(keys, normals, vertex_of, count)
            self.normals = self.normals.astype(np.int32)  # in units of 1e-5
            del normals, keys
        self.uvs = uv_index = None
        if uv is not None and len(uv):
            uv = _finite(uv)
            # Two float32 side by side are one 64-bit key; + 0 makes −0 the same as 0.
            keys = np.ascontiguousarray(uv + 0.0).view(np.int64).reshape(-1)
            self.uvs, uv_index = _indexed(keys, uv, vertex_of, count)

        self._indices = [i for i in (vertex_of, uv_index, normal_index) if i is not None]
        self.slots = sorted(set().union(*(np.unique(s).tolist() for _, s in polygons)))
        self.faces = {slot: [] for slot in self.slots}
        self._vertex_of = vertex_of
        for loops, slots in polygons:
            for slot in self.slots:
                chosen = loops[slots == slot] if len(self.slots) > 1 else loops
                if len(chosen):
                    self.faces[slot].append(chosen)
        self._separators = [" "] + ["/"] * (self.uvs is not None) \
            + ["/" if self.uvs is not None else "//"] * (self.normals is not None)

    def signature(self):
        """What is the same for equal meshes and quick to find."""
        return (len(self.positions), tuple(self.slots), tuple(len(t) for f in self.faces.values() for t in f),
                self.positions[:4].tobytes(), tuple(side[:2] for side in self.sides))

    def digest(self):
        """A hash of all that the file would hold."""
        sha = hashlib.sha256(("".join(self._separators) + str(self.slots)).encode())
        for array in (self.positions, self.normals, self.uvs, *self._indices,
                      *(loops for f in self.faces.values() for loops in f), *(values for _, _, values in self.sides)):
            sha.update(b"" if array is None else np.ascontiguousarray(array))
        return sha.digest()

    def write(self, out, progress=None):
        """The OBJ. Faces of slot n stand under `usemtl slot_n` when more than one is used."""
        tables = [t for f in self.faces.values() for t in f]
        total = sum(len(r) for r in (self.positions, self.uvs, self.normals, *tables) if r is not None)
        done = 0
        for lines in self._sections():
            for written, rows in lines:
                out.write(written)
                done += rows
                if progress and rows:
                    progress(done / total)

    def _sections(self):
        yield text.floats("v", self.positions)
        if self.uvs is not None:
            yield text.floats("vt", self.uvs)
        if self.normals is not None:
            yield text.units("vn", self.normals)
        for slot in self.slots:
            yield self._slot_line(slot)
            for table in self.faces[slot]:
                yield text.corners("f", table, self._indices, self._separators)

    def _slot_line(self, slot):
        return [(f"usemtl slot_{slot}\n".encode(), 0)] if len(self.slots) > 1 else []

    def write_side(self, out, kind, values):
        """The OBJ of the same faces with other UVs, or with colours of vertices."""
        rows = np.ascontiguousarray(values + np.float32(0.0))
        if kind == "colors":  # a vertex for each colour that one has
            keys = np.empty((len(rows), 4), dtype=np.uint32)
            keys[:, 0] = self._vertex_of
            keys[:, 1:] = rows.view(np.uint32)
            _, where, index = np.unique(keys.view(np.dtype((np.void, 16))).reshape(-1),
                                        return_index=True, return_inverse=True)
            vertices = np.hstack([self.positions[self._vertex_of[where]], rows[where]])
            indices, sections = [index.reshape(-1)], [text.floats("v", vertices)]
        else:
            keys = rows.view(np.int64).reshape(-1)
            rows, index = _indexed(keys, rows, self._vertex_of, len(self.positions))
            indices = [self._vertex_of, index]
            sections = [text.floats("v", self.positions), text.floats("vt", rows)]
        for slot in self.slots:
            sections.append(self._slot_line(slot))
            sections += [text.corners("f", loops, indices, " /"[:len(indices)]) for loops in self.faces[slot]]
        for lines in sections:
            for written, _ in lines:
                out.write(written)
