"""Evaluated meshes to OBJ files.

Positions are object space, metres, z up. Every polygon is written as
Blender's own triangles (a renderer's fan would differ on concave n-gons),
with split normals, so that flat, smooth, auto-smooth and custom normals all
arrive as they are.
"""

import hashlib
import math
import os
import re


def unique_name(name, taken):
    """A portable name made from a Blender name, different from all in `taken`."""
    stem = re.sub(r"[^A-Za-z0-9_-]+", "_", name).strip("_").lower() or "unnamed"
    candidate, n = stem, 2
    while candidate in taken:
        candidate, n = f"{stem}_{n}", n + 1
    return candidate


class MeshWriter:
    """Writes each distinct evaluated mesh once, and remembers its name."""

    def __init__(self, folder):
        self.folder = folder
        self.files = {}        # mesh name → file name
        self._by_hash = {}     # hash of the OBJ text → mesh name
        self._by_pointer = {}  # evaluated data → (mesh name, used slots) or None

    def add(self, ob):
        """The mesh name and the used material slots of an evaluated object.

        None when the object has no faces. Objects that share evaluated data
        (instances, linked duplicates) share the file.
        """
        key = ob.data.as_pointer()
        if key not in self._by_pointer:
            self._by_pointer[key] = self._write(ob)
        return self._by_pointer[key]

    def _write(self, ob):
        mesh = ob.to_mesh()
        if mesh is None:
            return None
        try:
            if not mesh.polygons:
                return None
            text, slots = obj_text(mesh)
        finally:
            ob.to_mesh_clear()
        digest = hashlib.sha256(text.encode()).digest()
        name = self._by_hash.get(digest)
        if name is None:
            # Evaluated data has names of its own in some versions.
            name = self._by_hash[digest] = unique_name(ob.original.data.name, self.files)
            self.files[name] = f"{name}.obj"
            with open(os.path.join(self.folder, self.files[name]), "w", encoding="ascii") as f:
                f.write(text)
        return name, slots


def corner_normals(mesh):
    """A function from loop index to the split normal, in any Blender version."""
    if hasattr(mesh, "calc_normals_split"):  # until 4.0
        mesh.calc_normals_split()
        return lambda loop: mesh.loops[loop].normal
    return lambda loop: mesh.corner_normals[loop].vector


class Pool:
    """Lines of one kind (`v`, `vn`, `vt`), each distinct one kept once."""

    def __init__(self, keyword, digits):
        self.index = {}
        self.lines = []
        self._format = f"%.{digits}f"
        self._keyword = keyword

    def add(self, values):
        """The 1-based index of the line for these values."""
        text = " ".join(self._trim(self._format % v) for v in values)
        i = self.index.get(text)
        if i is None:
            self.lines.append(f"{self._keyword} {text}")
            i = self.index[text] = len(self.lines)
        return i

    @staticmethod
    def _trim(text):
        text = text.rstrip("0").rstrip(".")
        return "0" if text == "-0" else text


def obj_text(mesh):
    """The OBJ of a mesh, and the sorted material slots its faces use.

    Faces of slot n stand under `usemtl slot_n` when more than one is used.
    Positions keep seven significant digits of the largest coordinate, normals
    five decimals (Blender's sixth depends on its threads), UVs six.
    """
    largest = max((abs(c) for v in mesh.vertices for c in v.co), default=0.0)
    if not math.isfinite(largest):
        raise ValueError(f'mesh "{mesh.name}" has a vertex that is not finite')
    digits = 6 if largest == 0.0 else max(0, 6 - math.floor(math.log10(largest)))
    positions, normals, uvs = Pool("v", digits), Pool("vn", 5), Pool("vt", 6)

    normal_of = corner_normals(mesh)
    uv_layer = next((l for l in mesh.uv_layers if l.active_render), None)
    last_slot = max(len(mesh.materials) - 1, 0)
    vertex = [positions.add(v.co) for v in mesh.vertices]

    mesh.calc_loop_triangles()
    faces = {}
    for triangle in mesh.loop_triangles:
        corners = []
        for v, loop in zip(triangle.vertices, triangle.loops):
            n = normals.add(normal_of(loop))
            t = uvs.add(uv_layer.data[loop].uv) if uv_layer else ""
            corners.append(f"{vertex[v]}/{t}/{n}")
        # Blender clamps the indices of faces whose slot was removed.
        slot = min(triangle.material_index, last_slot)
        faces.setdefault(slot, []).append("f " + " ".join(corners))

    slots = sorted(faces)
    lines = positions.lines + uvs.lines + normals.lines
    for slot in slots:
        if len(slots) > 1:
            lines.append(f"usemtl slot_{slot}")
        lines += faces[slot]
    return "\n".join(lines) + "\n", slots
