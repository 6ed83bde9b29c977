"""The whole export: Blender's scene in, scene.yaml and its files out.

`evaluated_depsgraph_get()` gives the *viewport's* scene: its subdivision
levels, its visibility. The export therefore runs as a render engine of its
own, for Blender hands an engine the scene as it is to be rendered.
"""

import math
import os
import sys
import time

import bpy
import numpy as np
from mathutils import Vector

from . import cycles, lights, settings, view, yaml
from .audit import DEFAULTS, Audit
from .animation import export_frames
from .bake import Baker
from .files import Folder
from .images import ImageWriter
from .log import Log
from .materials import MaterialWriter
from .meshes import LEAN, MeshWriter, unique_name
from .world import WorldWriter

FORMAT_VERSION = 1
BAKE_SIZE = 1024
# What only Cycles can evaluate is baked by it; taken from earlier bakes; left out and named.
BAKE, CACHED, NO_BAKE = "bake", "cached", "no bake"
# Curves, text and metaballs come with an instance of type MESH, their tessellation.
_SILENT = {"EMPTY", "CAMERA", "ARMATURE", "LATTICE", "SPEAKER", "LIGHT_PROBE",
           "CURVE", "SURFACE", "FONT", "META"}
# Properties of objects whose say reaches the scene by the world matrix, the
# evaluated mesh, visibility in the depsgraph, or the nodes that read them.
_CONVEYED = (
    "type", "data", "parent", "parent_type", "parent_bone", "parent_vertices", "track_axis", "up_axis",
    "location", "rotation_quaternion", "rotation_axis_angle", "rotation_euler", "rotation_mode", "scale",
    "dimensions", "delta_location", "delta_rotation_euler", "delta_rotation_quaternion", "delta_scale",
    "matrix_world", "matrix_local", "matrix_basis", "matrix_parent_inverse", "pass_index", "color",
    "hide_render", "instance_type", "instance_collection", "use_instance_vertices_rotation",
    "use_instance_faces_scale", "instance_faces_scale", "visible_volume_scatter", "field", "collision",
    "soft_body", "rigid_body", "rigid_body_constraint", "active_material", "cycles.motion_steps",
    "cycles.use_motion_blur", "cycles.use_deform_motion", "cycles.use_camera_cull", "cycles.use_distance_cull",
    "proxy_collection", "track_axis", "add_rest_position_attribute", "use_dynamic_topology_sculpting",
    "cycles.use_adaptive_subdivision", "cycles.dicing_rate",
)


class ExportError(Exception):
    """The scene could not be written; the message says why."""


class _Engine(bpy.types.RenderEngine):
    """A render engine that writes the scene instead of rendering it."""

    bl_idname = "SMITHWALK_EXPORT"
    bl_label = "smithwalk export"

    job = None     # called with the depsgraph
    error = None   # what it raised: Blender would print it and go on
    layer = None   # the view layer that is wanted, None for the first

    def render(self, depsgraph):
        """Called by Blender for each view layer."""
        cls = type(self)
        if cls.job is None or cls.layer not in {None, depsgraph.view_layer.name}:
            return
        job, cls.job = cls.job, None
        try:
            job(depsgraph)
        except Exception as error:  # raised again by `_with_depsgraph`
            cls.error = error


def _with_depsgraph(scene, layer, job):
    """Call `job` with the depsgraph of a final render; returns what it returned."""
    render = scene.render
    # What would otherwise happen around an engine's own work.
    changed = {"engine": _Engine.bl_idname, "use_compositing": False, "use_sequencer": False,
               "use_border": False, "use_multiview": False}
    kept = {name: getattr(render, name) for name in changed}
    result, ran = [], []

    def called(depsgraph):
        ran.append(True)
        result.append(job(depsgraph))

    stand_in = None
    if scene.camera is None:  # Blender does not render without; the export tells it
        stand_in = bpy.data.objects.new("smithwalk", bpy.data.cameras.new("smithwalk"))
        scene.collection.objects.link(stand_in)
        scene.camera = stand_in
    bpy.utils.register_class(_Engine)
    try:
        _Engine.job, _Engine.error, _Engine.layer = called, None, layer
        for name, value in changed.items():
            setattr(render, name, value)
        with cycles.quiet_handlers():
            bpy.ops.render.render(scene=scene.name)
    finally:
        for name, value in kept.items():
            setattr(render, name, value)
        bpy.utils.unregister_class(_Engine)
        if stand_in is not None:
            data = stand_in.data
            bpy.data.objects.remove(stand_in)
            bpy.data.cameras.remove(data)
    if _Engine.error is not None:
        raise _Engine.error
    if not ran:
        raise ExportError("Blender did not hand over the scene to be rendered"
                          + (f' (is there a view layer "{layer}" that is used for rendering?)' if layer else ""))
    return result[0]


def progress_to_terminal(what, share):
    """A line on standard error, where that is a terminal; else only the steps' names."""
    if sys.stderr.isatty():
        print(f"\r\x1b[K{what} {100 * share:3.0f} %", end="\n" if share >= 1.0 else "", file=sys.stderr, flush=True)


class Job:
    """One export: what it needs to know, and the parts that write."""

    def __init__(self, scene, folder, log=None, bake=BAKE, bake_size=BAKE_SIZE, layer=None,
                 progress=progress_to_terminal, by_engine=False):
        self.scene = scene
        self.folder = folder
        self.log = log or Log()
        self.audit = Audit()
        self.layer = layer
        self.progress = progress
        self.composited = not by_engine and settings.has_compositor(scene)
        self.border = scene.render.use_border
        self.stereo = scene.render.use_multiview
        self.has_camera = scene.camera is not None
        self.bake = bake
        self.by_engine = by_engine  # Blender itself sees to the compositor, the region, other view layers
        self.baker = Baker(bake_size, bake == BAKE, self.log, progress)
        self.materials = MaterialWriter(None, self.log, self.audit)
        view_layer = scene.view_layers.get(layer) if layer else next(
            (l for l in scene.view_layers if l.use), scene.view_layers[0])
        if view_layer is None:
            raise ExportError(f'no view layer "{layer}": there is '
                              + ", ".join(f'"{l.name}"' for l in scene.view_layers))
        self.world = WorldWriter(scene, view_layer, Audit(), self.log, bake == BAKE, progress)
        self._sites = {}
        self._view = None  # nodes of the view transform's table

    def prepare(self):
        """What takes renders of its own: defaults of all structs, the world, bakes."""
        DEFAULTS.prepare()
        if not view.is_plain(self.scene):
            self._view = view.table(self.scene)
        if self.bake == NO_BAKE:
            return
        self.world.prepare()
        if any(self._needs(m).requests for m in bpy.data.materials if m.users):
            _with_depsgraph(self.scene, self.layer, self.plan)
            self.baker.run()

    def prepare_from(self, depsgraph):
        """Within a render: what earlier bakes left in the cache."""
        self.world.prepare()
        if any(self._needs(m).requests for m in bpy.data.materials if m.users):
            self.plan(depsgraph)
            self.baker.run()

    def _needs(self, material):
        return self.materials.needs(material)

    def plan(self, depsgraph):
        """Register the bakes of all objects."""
        for ob, matrix, slots, materials in self._surfaces(depsgraph):
            needs = [self._needs(m) for m in materials]
            if any(n.requests or n.surface for n in needs):
                self.baker.plan(ob, matrix, materials, needs, depsgraph)

    def _surfaces(self, depsgraph):
        """Each evaluated mesh object once: (object, matrix, used slots, materials by used slot)."""
        seen = set()
        for instance in depsgraph.object_instances:
            ob = instance.object
            if ob.type != "MESH" or not instance.show_self or not len(ob.data.polygons):
                continue
            key = (ob.name_full, ob.data.as_pointer())
            if key in seen:
                continue
            seen.add(key)
            slots = _used_slots(ob.data)
            yield ob, instance.matrix_world.copy(), slots, [self._slot_material(ob, i, depsgraph) for i in slots]

    def _slot_material(self, ob, index, depsgraph):
        """The material of a slot: the view layer's override, the object's own, or the mesh's."""
        override = depsgraph.view_layer.material_override
        if override is not None:
            return override
        slots = ob.material_slots
        if index < len(slots) and slots[index].link == "OBJECT":
            return slots[index].material
        mesh_materials = ob.data.materials
        return mesh_materials[index] if index < len(mesh_materials) else None

    # Writing

    def write(self, depsgraph):
        """Write the scene that a depsgraph of a final render holds; returns the log."""
        files = Folder(self.folder)
        try:
            return self._write(depsgraph, files)
        finally:
            files.close()

    def _write(self, depsgraph, files):
        sections, note, options = self._sections(depsgraph, files)
        self.log.path = files.commit(yaml.document(sections, note=note))
        self.log.options = options
        for kind in ("objects", "lights", "meshes", "materials", "textures"):
            self.log.count(kind, len(sections.get(kind, ())))
        return self.log

    def frame(self, depsgraph):
        """The sections of a frame, their files by name, the scene's note, and options of the renderer."""
        files = Folder(self.folder)
        sections, note, options = self._sections(depsgraph, files)
        return sections, files.paths(), note, options

    def _sections(self, depsgraph, files):
        scene, log = self.scene, self.log
        images = ImageWriter(files, log)
        self.materials.images = images
        meshes = MeshWriter(files, log)
        objects, lamps = self._objects(depsgraph, meshes)
        if not objects:
            log.note("scene", "has no surfaces")
        world, suns = self.world.section(images)
        lamps += suns
        camera = lights.camera(scene if self.has_camera else _NoCamera, depsgraph, self.audit, log)
        if self.world.backdrop is not None and not scene.render.film_transparent \
                and getattr(getattr(self.world.data, "cycles_visibility", None), "camera", True):
            if "clip" in camera:  # the camera would not see a box that far
                log.warn(self.world.where, "looks different to the camera than to light in Blender, and the camera "
                                           "clips: what lights the scene is written")
            else:
                objects.append(self._backdrop(files, meshes, _reach(depsgraph)))
        render = scene.render
        border, render.use_border = render.use_border, self.border
        try:
            settings.tell(scene, depsgraph.view_layer, self.audit, log, self.composited, self.by_engine)
            options = settings.options(scene)
        finally:
            render.use_border = border
        if self.stereo:
            log.warn("scene", "of the views of stereo rendering the camera's own is written")
        others = [l.name for l in scene.view_layers if l.use and l.name != depsgraph.view_layer.name]
        if others and not self.by_engine:
            log.warn("scene", f'only view layer "{depsgraph.view_layer.name}" is written, not '
                              + ", ".join(f'"{n}"' for n in others))

        sections = {
            "smithwalk": FORMAT_VERSION,
            "light_units": lights.light_units(),
            "camera": camera,
            "film": settings.film(scene, log, None if self._view is None else view.section(self._view, files)),
            "sampling": settings.sampling(scene, depsgraph.view_layer),
            "world": world,
            "textures": self.materials.textures,
            "materials": self.materials.materials,
            "meshes": meshes.meshes,
            "objects": objects,
            "lights": lamps,
        }
        sections = {k: v for k, v in sections.items() if v not in (None, {}, [])}
        note = scene.get("smithwalk_note") or ""
        if options:
            note += ("\n" if note else "") + "Blender's settings as options of `smithwalk render`: " + " ".join(options)
        return sections, note, options

    def _backdrop(self, files, meshes, reach):
        """A box around all that shines for the camera alone: the world that it sees."""
        name, material = (unique_name("backdrop", taken) for taken in (meshes.meshes, self.materials.materials))
        path, file = files.new(f"{name}.obj")
        corners = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
        faces = ((1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4))
        with open(path, "w", encoding="ascii") as f:
            f.writelines(f"v {x * reach:.9g} {y * reach:.9g} {z * reach:.9g}\n" for x, y, z in corners)
            f.writelines("f {} {} {} {}\n".format(*face) for face in faces)
        meshes.meshes[name] = {"file": file}
        self.materials.materials[material] = {"emission": {"color": [max(c, 0.0) for c in self.world.backdrop]}}
        return {"name": "Backdrop", "mesh": name, "material": material, "hidden_from": list(lights.RAYS)}

    def _objects(self, depsgraph, meshes):
        """Objects and lights, every instance on its own with its world matrix."""
        objects, lamps = [], []
        lamp_writer = lights.LightWriter(self.audit, self.log)
        audited = set()
        last = time.monotonic()
        total = len(depsgraph.object_instances)
        for i, instance in enumerate(depsgraph.object_instances):
            if time.monotonic() - last > 0.2:
                last = time.monotonic()
                self.progress("exporting", i / total)
            ob = instance.object
            where = f'object "{ob.name}"'
            if not instance.is_instance and any(
                    m.type == "PARTICLE_SYSTEM" and m.show_render and m.particle_system
                    and m.particle_system.settings.type == "HAIR"
                    and m.particle_system.settings.render_type == "PATH" for m in ob.modifiers):
                self.log.wrong(where, "its hair is missing")
            if not instance.show_self:  # e.g. an emitter hidden behind its instances
                continue
            # The iterator reuses the instance: copy before going on.
            matrix = instance.matrix_world.copy()
            if ob.type == "LIGHT":
                lamp = lamp_writer.add(ob, matrix)
                if lamp:
                    lamps.append(lamp)
            elif ob.type == "MESH":
                entry = self._object(ob, matrix, meshes, depsgraph, where, instance.is_instance)
                if entry:
                    objects.append(entry)
                else:
                    continue
            elif ob.type not in _SILENT:
                self.log.wrong(where, f"a {ob.type.lower().replace('_', ' ')} is missing")
                continue
            else:
                continue
            if ob.name_full not in audited:
                audited.add(ob.name_full)
                self._audit_object(ob, where)
        self.progress("exporting", 1.0)
        return objects, lamps

    def _audit_object(self, ob, where):
        """Name what of an object is another picture and was not carried."""
        view = self.audit.view(ob)
        view.accept(*_CONVEYED)
        view.accept("visible_camera", "is_holdout", "is_shadow_catcher", *(f"visible_{kind}" for kind in lights.RAYS))
        if ob.is_shadow_catcher and ob.type != "LIGHT":  # lights have the flag by default
            self.log.warn(where, "shadow catcher is left out: the object is seen")
        if getattr(self.scene.cycles, "feature_set", "EXPERIMENTAL") == "EXPERIMENTAL" \
                and getattr(getattr(ob, "cycles", None), "use_adaptive_subdivision", False):
            self.log.warn(where, "adaptive subdivision is written with the modifier's levels")
        for what in self.audit.leftovers(ob):
            self.log.warn(where, f"{what}: left out")

    def _object(self, ob, matrix, meshes, depsgraph, where, is_instance):
        if not len(ob.data.polygons):
            return None
        if not lights.is_finite(matrix):
            self.log.note(where, "its matrix is not finite: left out")
            return None
        transform = None
        largest = max(c.length for c in matrix.to_3x3().col)
        if abs(matrix.to_3x3().determinant()) <= 1e-6 * 1e-6 * largest ** 3 or largest < 1e-6:
            rank = _rank(matrix)
            if rank < 2:
                self.log.note(where, "has no extent (scale 0): left out")
                return None
            transform = matrix  # a flattened object: its scale goes into the vertices
            self.log.warn(where, "its scale flattens it: its faces are shaded flat, not smooth")
        slots = _used_slots(ob.data)
        materials = [self._slot_material(ob, i, depsgraph) for i in slots]
        needs = [self._needs(m) for m in materials]
        sites, uv = [None] * len(slots), None
        if any(n.requests for n in needs):
            key = (ob.name_full, ob.data.as_pointer())
            if key not in self._sites:
                self._sites[key] = self.baker.site(ob, matrix, materials, needs)
            sites, uv = self._sites[key]
            if is_instance and any(n.instance for n in needs):
                self.log.warn(where, "what its materials take from the place or number of an instance is the same "
                                     "for all of them")
        by_slot = {i: self.materials.add(m, s) for i, m, s in zip(slots, materials, sites)}
        uv_maps, colors = self.materials.attributes(by_slot.values())
        written = meshes.add(ob, uv_maps, colors, uv, self.materials.looks_along(by_slot.values()), transform,
                             lambda share: self.progress(f"exporting {ob.name}", share))
        if written is None:
            return None
        mesh, used = written
        names = [by_slot[i] for i in used]
        entry = {"name": ob.name, "mesh": mesh}
        if len(names) == 1:
            entry["material"] = names[0]
        else:
            entry["materials"] = {f"slot_{i}": name for i, name in zip(used, names)}
        if transform is None:
            entry["transform"] = lights.matrix(matrix)
        original = ob.original
        if not ob.visible_camera or original.indirect_only_get(view_layer=depsgraph.view_layer):
            entry["visible_to_camera"] = False
        hidden = lights.hidden_from(ob)
        if hidden:
            entry["hidden_from"] = hidden
        if ob.is_holdout or original.holdout_get(view_layer=depsgraph.view_layer):
            entry["holdout"] = True
        self._check_tangents(ob, names, where)
        self._check_bumps(ob, matrix, names, where)
        return entry

    def _check_bumps(self, ob, matrix, names, where):
        """Far from the surface, Cycles loses light on leaning normals, which is kept here."""
        steepest = max(self.materials.steepness[n] for n in names)
        if steepest:
            areas = np.empty(len(ob.data.polygons), dtype=np.float32)
            ob.data.polygons.foreach_get("area", areas)
            side = math.sqrt(max(float(np.nansum(areas)), 1e-12) * abs(matrix.to_3x3().determinant()) ** (2.0 / 3.0))
            angle = math.degrees(math.atan(steepest / max(side, 1e-6)))
            if angle > LEAN:
                self.log.warn(where, f"bumps lean normals by some {angle:.0f}°: light that Cycles loses there is kept, "
                                     "and goes elsewhere")

    def _check_tangents(self, ob, names, where):
        """Blender's radial tangents turn in coordinates that the bounding box scales, the
        renderer's in unscaled ones."""
        corners = [tuple(c) for c in ob.bound_box]
        extent = [max(c[i] for c in corners) - min(c[i] for c in corners) for i in range(3)]
        size = max(extent)
        for axis in sorted(set().union(*(self.materials.radial_axes[n] for n in names))):
            i, j = (k for k in range(3) if k != "xyz".index(axis))
            if abs(extent[i] - extent[j]) > 1e-3 * size:
                self.log.warn(where, f"its radial tangent about {axis} ignores that the bounding box is uneven")


def _reach(depsgraph):
    """Half the side of a cube about the origin that holds all, with room, in metres."""
    corners = [(instance.matrix_world @ Vector(corner)) for instance in depsgraph.object_instances
               if lights.is_finite(instance.matrix_world) for corner in instance.object.bound_box]
    return 4.0 * max([1.0] + [abs(c) for corner in corners for c in corner if math.isfinite(c)])


class _NoCamera:
    """Stands for a scene without a camera."""

    camera = None


def _used_slots(mesh):
    slots = np.empty(len(mesh.polygons), dtype=np.int32)
    mesh.polygons.foreach_get("material_index", slots)
    return [int(s) for s in np.unique(np.clip(slots, 0, max(len(mesh.materials) - 1, 0)))]


def _rank(matrix):
    values = np.linalg.svd(np.array(matrix.to_3x3()), compute_uv=False)
    return int((values > max(values.max() * 1e-6, 1e-9)).sum())


def export(scene, folder, bake=BAKE, bake_size=BAKE_SIZE, layer=None, progress=progress_to_terminal, frames=None):
    """Write `scene` to `folder`/scene.yaml, with a file for each of `frames` if they are named;
    returns the Log. Raises ExportError."""
    try:
        os.makedirs(folder, exist_ok=True)
        if frames is not None:
            return _export_frames(scene, folder, frames, layer, bake=bake, bake_size=bake_size, progress=progress)
        job = Job(scene, folder, bake=bake, bake_size=bake_size, layer=layer, progress=progress)
        job.prepare()
        return _with_depsgraph(scene, layer, job.write)
    except OSError as error:
        raise ExportError(f"{folder} can't be written: {error.strerror or error} "
                          f"({error.filename})" if error.filename else str(error)) from error


def _export_frames(scene, folder, frames, layer, **options):
    current, subframe = scene.frame_current, scene.frame_subframe

    def sections_of(number, beside, log):
        scene.frame_set(number)
        job = Job(scene, beside, log=log, layer=layer, **options)
        job.prepare()
        return _with_depsgraph(scene, layer, job.frame)

    try:
        with cycles.quiet_handlers():
            return export_frames(frames, folder, sections_of)
    finally:
        scene.frame_set(current, subframe=subframe)
