"""The whole export: Blender's scene in, scene.yaml and its files out.

`evaluated_depsgraph_get()` gives the *viewport's* scene: its subdivision
levels, its visibility. The export therefore runs as a render engine of its
own, for Blender hands an engine the scene as it is to be rendered.
"""

import os

import bpy

from . import lights, yaml
from .images import ImageWriter
from .log import Log
from .materials import MaterialWriter
from .meshes import MeshWriter

FORMAT_VERSION = 1
# Curves, text and metaballs come with an instance of type MESH, their tessellation.
_SILENT = {"EMPTY", "CAMERA", "ARMATURE", "LATTICE", "SPEAKER", "LIGHT_PROBE",
           "CURVE", "SURFACE", "FONT", "META"}


class ExportError(Exception):
    """The scene could not be written; the message says why."""


class _Engine(bpy.types.RenderEngine):
    """A render engine that writes the scene instead of rendering it."""

    bl_idname = "SMITHWALK_EXPORT"
    bl_label = "smithwalk export"

    job = None     # called with the depsgraph
    error = None   # what it raised: Blender would print it and go on

    def render(self, depsgraph):
        """Called by Blender for each view layer."""
        cls = type(self)
        if cls.job is None:
            return
        job, cls.job = cls.job, None
        try:
            job(depsgraph)
        except Exception as error:  # re-raised by `export`
            cls.error = error


def export(scene, folder):
    """Write `scene` to `folder`/scene.yaml; returns the Log. Raises ExportError."""
    try:
        os.makedirs(folder, exist_ok=True)
    except OSError as error:
        raise ExportError(f"{folder} can't be written: {error.strerror}") from error

    log = Log()
    render = scene.render
    # What would otherwise happen around an engine's own work.
    changed = {"engine": _Engine.bl_idname, "use_compositing": False, "use_sequencer": False,
               "use_border": False}
    if render.use_border:
        log.warn("scene", "the render region is left out: the whole frame is written")
    kept = {name: getattr(render, name) for name in changed}
    ran = []

    def job(depsgraph):
        ran.append(True)
        _write(scene, depsgraph, folder, log)

    bpy.utils.register_class(_Engine)
    try:
        _Engine.job, _Engine.error = job, None
        for name, value in changed.items():
            setattr(render, name, value)
        bpy.ops.render.render(scene=scene.name)
    finally:
        for name, value in kept.items():
            setattr(render, name, value)
        bpy.utils.unregister_class(_Engine)
    if _Engine.error is not None:
        raise _Engine.error
    if not ran:
        raise ExportError("Blender did not hand over the scene to be rendered (is there a camera?)")
    return log


def _write(scene, depsgraph, folder, log):
    meshes = MeshWriter(folder)
    images = ImageWriter(folder, log)
    materials = MaterialWriter(images, log)
    objects, lamps = _objects(depsgraph, meshes, materials, log)
    if not objects:
        log.warn("scene", "has no surfaces")
    if scene.render.use_motion_blur:
        log.warn("scene", "motion blur is left out")

    sections = {
        "smithwalk": FORMAT_VERSION,
        "light_units": lights.light_units(),
        "camera": lights.camera(scene, depsgraph, log),
        "film": _film(scene, log),
        "sampling": _sampling(scene, log),
        "world": lights.world(scene, images, log),
        "textures": materials.textures,
        "materials": materials.materials,
        "meshes": {name: {"file": file} for name, file in meshes.files.items()},
        "objects": objects,
        "lights": lamps,
    }
    sections = {k: v for k, v in sections.items() if v not in (None, {}, [])}
    path = os.path.join(folder, "scene.yaml")
    with open(path, "w", encoding="utf-8") as f:
        f.write(yaml.document(sections, note=scene.get("smithwalk_note")))
    log.path = path
    for kind in ("objects", "lights", "meshes", "materials", "textures"):
        log.count(kind, len(sections.get(kind, ())))


def _objects(depsgraph, meshes, materials, log):
    """Objects and lights, every instance on its own with its world matrix."""
    objects, lamps = [], []
    for instance in depsgraph.object_instances:
        ob = instance.object
        if not instance.show_self:  # e.g. an emitter hidden behind its instances
            continue
        where = f'object "{ob.name}"'
        if ob.type == "LIGHT":
            lamp = lights.light(ob, instance.matrix_world.copy(), log)
            if lamp:
                lamps.append(lamp)
        elif ob.type == "MESH":
            # The iterator reuses the instance: copy before going on.
            entry = _object(ob, instance.matrix_world.copy(), meshes, materials, log, where)
            if entry:
                objects.append(entry)
        elif ob.type not in _SILENT:
            log.warn(where, f"a {ob.type.lower()} can't be carried")
    return objects, lamps


def _object(ob, world_matrix, meshes, materials, log, where):
    written = meshes.add(ob)
    if written is None:
        return None
    mesh, slots = written
    names = [materials.add(_slot_material(ob, i)) for i in slots]
    entry = {"name": ob.name, "mesh": mesh}
    if len(names) == 1:
        entry["material"] = names[0]
    else:
        entry["materials"] = {f"slot_{i}": name for i, name in zip(slots, names)}
    entry["transform"] = lights.matrix(world_matrix)
    if not ob.visible_camera:
        entry["visible_to_camera"] = False
    for kind in ("diffuse", "glossy", "transmission", "shadow"):
        if not getattr(ob, f"visible_{kind}"):
            log.warn(where, f"hidden from {kind} rays in Blender, visible here")
    for flag in ("is_holdout", "is_shadow_catcher"):
        if getattr(ob, flag, False):
            log.warn(where, f"{flag[3:].replace('_', ' ')} is left out")
    if any(m.type == "PARTICLE_SYSTEM" and m.particle_system.settings.render_type == "PATH"
           for m in ob.modifiers):
        log.warn(where, "hair particles are left out")
    _check_coordinates(ob, names, materials, log, where)
    return entry


def _slot_material(ob, index):
    """The material of a slot: the object's own if the slot is linked to it, else the mesh's."""
    slots = ob.material_slots
    if index < len(slots) and slots[index].link == "OBJECT":
        return slots[index].material
    mesh_materials = ob.data.materials
    return mesh_materials[index] if index < len(mesh_materials) else None


def _check_coordinates(ob, names, materials, log, where):
    """Name where UVs or tangents of this object differ from Blender's."""
    active = next((l.name for l in ob.data.uv_layers if l.active_render), None)
    wanted = set().union(*(materials.uv_maps[n] for n in names))
    for name in sorted(wanted - {active}):
        log.warn(where, f'UV map "{name}" is asked for, but only the active one is written')
    # Blender's radial tangents turn about the middle of the bounding box, in
    # coordinates scaled by it; the renderer's turn about the object's axis.
    corners = [tuple(c) for c in ob.bound_box]
    low = [min(c[i] for c in corners) for i in range(3)]
    high = [max(c[i] for c in corners) for i in range(3)]
    size = max(h - l for l, h in zip(low, high))
    for axis in sorted(set().union(*(materials.radial_axes[n] for n in names))):
        i, j = (k for k in range(3) if k != "xyz".index(axis))
        off_axis = max(abs(low[k] + high[k]) for k in (i, j)) > 1e-3 * size
        uneven = abs((high[i] - low[i]) - (high[j] - low[j])) > 1e-3 * size
        if off_axis or uneven:
            log.warn(where, f"its radial tangent turns about the object's {axis} axis, "
                            "Blender's about the bounding box")


def _film(scene, log):
    render = scene.render
    percent = render.resolution_percentage / 100.0
    film = {"width": max(int(render.resolution_x * percent), 1),
            "height": max(int(render.resolution_y * percent), 1)}
    kind = scene.cycles.pixel_filter_type
    if kind == "BOX":
        film["filter"] = {"box": {}}
    else:
        if kind != "BLACKMAN_HARRIS":
            log.warn("scene", f"pixel filter {kind.lower()} is written as Blackman-Harris")
        film["filter"] = {"blackman_harris": {"width": scene.cycles.filter_width}}
    if scene.view_settings.exposure != 0.0:
        film["exposure"] = scene.view_settings.exposure
    if scene.cycles.film_exposure != 1.0:
        log.warn("scene", "Cycles' film exposure is left out (it would scale the EXR)")
    if render.film_transparent:
        log.warn("scene", "transparent film is left out")
    return film


def _sampling(scene, log):
    cycles = scene.cycles
    bounces = cycles.max_bounces
    lower = [f"{kind} {getattr(cycles, f'{kind}_bounces')}" for kind in ("diffuse", "glossy", "transmission")
             if getattr(cycles, f"{kind}_bounces") < bounces]
    if lower:
        log.warn("scene", f"bounce limits per kind are left out ({', '.join(lower)}): {bounces} for all")
    if cycles.sample_clamp_direct or cycles.sample_clamp_indirect:
        log.warn("scene", "clamping of samples is left out")
    return {"spp": cycles.samples, "seed": cycles.seed, "max_bounces": bounces}
