"""Small renders by Cycles inside of an export: bakes of sockets, panoramas of worlds.

Everything happens in a scene of its own that is removed again. Results are
cached by content (node trees, images, meshes, Blender's version) in the
user's cache folder, so that exporting again costs nothing.
"""

import contextlib
import hashlib
import os
import tempfile

import bpy
import numpy as np

from .audit import harvest

_HANDLERS = ("render_init", "render_pre", "render_post", "render_write", "render_complete",
             "render_cancel", "render_stats", "frame_change_pre", "frame_change_post",
             "depsgraph_update_pre", "depsgraph_update_post", "object_bake_pre", "object_bake_complete",
             "object_bake_cancel")


@contextlib.contextmanager
def quiet_handlers():
    """The user's own handlers are left alone: they do not run for what an export renders."""
    kept = {}
    for name in _HANDLERS:
        handlers = getattr(bpy.app.handlers, name, None)
        if handlers:
            kept[name] = list(handlers)
            handlers.clear()
    try:
        yield
    finally:
        for name, functions in kept.items():
            getattr(bpy.app.handlers, name)[:] = functions


@contextlib.contextmanager
def temporary_scene(samples):
    """A scene for Cycles with everything off that a bake does not need."""
    scene = bpy.data.scenes.new("smithwalk")
    window = bpy.context.window
    before = window.scene if window else None
    try:
        scene.render.engine = "CYCLES"
        cycles = scene.cycles
        for name, value in (("device", "CPU"), ("samples", samples), ("use_adaptive_sampling", False),
                            ("use_denoising", False), ("seed", 0), ("max_bounces", 0), ("use_auto_tile", False),
                            ("sample_clamp_indirect", 0.0), ("pixel_filter_type", "BOX")):
            if hasattr(cycles, name):
                setattr(cycles, name, value)
        scene.render.dither_intensity = 0.0
        scene.render.use_compositing = scene.render.use_sequencer = False
        if window:
            window.scene = scene
        yield scene
    finally:
        if window:
            window.scene = before
        bpy.data.scenes.remove(scene)


def fingerprint(tree):
    """A text that says all that a node tree holds, the images it reads included."""
    lines = []
    for node in tree.nodes:
        lines.append(f"{node.bl_idname} {node.name} {node.mute} {sorted(harvest(node).items(), key=str)}")
        for socket in list(node.inputs) + (list(node.outputs) if node.type in {"VALUE", "RGB"} else []):
            value = getattr(socket, "default_value", None)
            value = tuple(value) if hasattr(value, "__len__") and not isinstance(value, str) else value
            lines.append(f"  {socket.identifier} {value}")
        for name in ("color_ramp", "mapping"):
            inner = getattr(node, name, None)
            if name == "color_ramp" and inner is not None:
                lines += [f"  {e.position} {tuple(e.color)}" for e in inner.elements]
            elif inner is not None and hasattr(inner, "curves"):
                lines += [f"  {[(tuple(p.location), p.handle_type) for p in c.points]}" for c in inner.curves]
        image = getattr(node, "image", None)
        if image is not None:
            lines.append("  " + _image_state(image))
        if node.type == "GROUP" and node.node_tree:
            lines.append(fingerprint(node.node_tree))
    for link in tree.links:
        lines.append(f"{link.from_node.name}.{link.from_socket.identifier} > "
                     f"{link.to_node.name}.{link.to_socket.identifier} {link.is_muted}")
    return "\n".join(lines)


def _image_state(image):
    path = image.filepath_from_user()
    state = [image.name_full, image.colorspace_settings.name, image.alpha_mode, image.source, tuple(image.size)]
    if image.packed_file:
        state.append(hashlib.sha256(image.packed_file.data).hexdigest())
    elif os.path.isfile(path):
        state += [path, os.path.getmtime(path), os.path.getsize(path)]
    elif image.has_data and image.size[0]:
        values = np.empty(image.size[0] * image.size[1] * image.channels, dtype=np.float32)
        image.pixels.foreach_get(values)
        state.append(hashlib.sha256(values.tobytes()).hexdigest())
    return str(state)


_FORMAT = 2  # changes where the same scene would be baked otherwise than before


class Cache:
    """Arrays by the hash of what they were made from."""

    def __init__(self):
        base = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
        self.folder = os.path.join(base, "smithwalk", "bakes")

    @staticmethod
    def key(*parts):
        """The hash of some texts, and of this Blender's version."""
        sha = hashlib.sha256(f"{bpy.app.version} {_FORMAT}".encode())
        for part in parts:
            sha.update(b"\0" + str(part).encode())
        return sha.hexdigest()

    def get(self, key):
        """The arrays, or None."""
        try:
            with np.load(os.path.join(self.folder, key + ".npz"), allow_pickle=False) as stored:
                return {name: stored[name] for name in stored.files}
        except (OSError, ValueError, KeyError, EOFError):
            return None

    def put(self, key, **arrays):
        """Store arrays; a cache that can't be written is no error."""
        try:
            os.makedirs(self.folder, exist_ok=True)
            handle, beside = tempfile.mkstemp(suffix=".npz", dir=self.folder)
            os.close(handle)
            np.savez(beside, **arrays)
            os.replace(beside, os.path.join(self.folder, key + ".npz"))
        except OSError:
            pass


def render_exr(scene):
    """Render a scene; its pixels (height, width, 4), bottom row first, scene-linear."""
    render = scene.render
    settings = render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "IMAGE"
    settings.file_format, settings.color_mode, settings.color_depth = "OPEN_EXR", "RGBA", "32"
    with tempfile.TemporaryDirectory() as folder:
        render.use_file_extension = False
        render.filepath = os.path.join(folder, "render.exr")
        with quiet_handlers():
            bpy.ops.render.render(write_still=True, scene=scene.name)
        image = bpy.data.images.load(render.filepath)
        try:
            image.colorspace_settings.name = "Non-Color"
            values = np.empty(image.size[0] * image.size[1] * image.channels, dtype=np.float32)
            image.pixels.foreach_get(values)
            return values.reshape(image.size[1], image.size[0], image.channels)
        finally:
            bpy.data.images.remove(image)


# Bakes

_UV = "smithwalk bake"


def expose(tree, groups, node_name, identifier):
    """An output socket in `tree` that carries what feeds an input (or, with no identifier,
    the node's first output) inside of nested groups, whose trees are copied on the way."""
    if not groups:
        node = tree.nodes[node_name]
        if identifier is None:
            return node.outputs[0]
        socket = next(s for s in node.inputs if s.identifier == identifier)
        link = next(l for l in socket.links if l.is_valid)
        return link.from_socket
    group = tree.nodes[groups[0]]
    group.node_tree = group.node_tree.copy()
    inner = group.node_tree
    found = expose(inner, groups[1:], node_name, identifier)
    kind = "NodeSocketShader" if found.type == "SHADER" else "NodeSocketColor"
    if hasattr(inner, "interface"):
        inner.interface.new_socket("smithwalk", in_out="OUTPUT", socket_type=kind)
    else:
        inner.outputs.new(kind, "smithwalk")
    leave = next(n for n in inner.nodes if n.type == "GROUP_OUTPUT" and n.is_active_output)
    target = [s for s in leave.inputs if s.name == "smithwalk"][-1]
    inner.links.new(found, target)
    return [s for s in group.outputs if s.name == "smithwalk"][-1]


def _emitter(material, request, image):
    """A copy of a material that emits what feeds a socket, with `image` as the bake's target."""
    copy = material.copy() if material else bpy.data.materials.new("smithwalk")
    trees = set(bpy.data.node_groups)
    if not copy.use_nodes:
        copy.use_nodes = True
    tree = copy.node_tree
    target = tree.nodes.new("ShaderNodeTexImage")
    target.image = image
    for node in tree.nodes:
        node.select = False
    target.select = True
    tree.nodes.active = target
    output = tree.get_output_node("CYCLES") or tree.nodes.new("ShaderNodeOutputMaterial")
    for socket in output.inputs:
        for link in list(socket.links):
            tree.links.remove(link)
    emission = tree.nodes.new("ShaderNodeEmission")
    emission.inputs["Color"].default_value = (0.0, 0.0, 0.0, 1.0)
    if request is not None:
        groups, node_name, identifier = request
        source = expose(tree, groups, node_name, identifier)
        if source.type == "SHADER":
            tree.links.new(source, output.inputs["Surface"])
            return copy, set(bpy.data.node_groups) - trees
        tree.links.new(source, emission.inputs["Color"])
    tree.links.new(emission.outputs[0], output.inputs["Surface"])
    return copy, set(bpy.data.node_groups) - trees


def bake(mesh, matrix, look, passes, size, unwrap=True):
    """Bake passes over a mesh; each pass is a list of (material, request or None) by slot.

    `mesh` is a datablock of the caller's, given slots and a UV map here;
    `look` sets what object nodes read. Returns the images (size, size, 3),
    bottom row first, and the UVs (loops, 2).
    """
    with temporary_scene(samples=4) as scene, quiet_handlers():
        ob = bpy.data.objects.new("smithwalk", mesh)
        images = []
        try:
            scene.collection.objects.link(ob)
            ob.matrix_world = matrix
            look(ob)
            layer = scene.view_layers[0]
            layer.objects.active = ob
            ob.select_set(True, view_layer=layer)
            override = dict(scene=scene, view_layer=layer, object=ob, active_object=ob,
                            selected_objects=[ob], selected_editable_objects=[ob])
            original = mesh.uv_layers.active.name if mesh.uv_layers.active else None
            if unwrap:
                while len(mesh.uv_layers) >= 8:
                    mesh.uv_layers.remove(mesh.uv_layers[-1])
                uv = mesh.uv_layers.new(name=_UV, do_init=False)
                name = uv.name
                mesh.uv_layers.active = mesh.uv_layers[name]
                with bpy.context.temp_override(**override):
                    bpy.ops.object.mode_set(mode="EDIT")
                    bpy.ops.mesh.reveal()
                    bpy.ops.mesh.select_all(action="SELECT")
                    bpy.ops.uv.smart_project(angle_limit=1.15, island_margin=0.01)
                    bpy.ops.object.mode_set(mode="OBJECT")
            else:
                name = _UV
            layer_uv = mesh.uv_layers[name]
            coordinates = np.empty(len(mesh.loops) * 2, dtype=np.float32)
            layer_uv.data.foreach_get("uv", coordinates)
            mesh.uv_layers.active = layer_uv
            if original and original in mesh.uv_layers:
                mesh.uv_layers[original].active_render = True
            for slots in passes:
                image = bpy.data.images.new("smithwalk bake", size, size, alpha=False, float_buffer=True)
                image.colorspace_settings.name = "Non-Color"
                materials, trees = [], set()
                try:
                    for material, request in slots:
                        copy, made = _emitter(material, request, image)
                        materials.append(copy)
                        trees |= made
                    mesh.materials.clear()
                    for material in materials:
                        mesh.materials.append(material)
                    with bpy.context.temp_override(**override):
                        bpy.ops.object.bake(type="EMIT", target="IMAGE_TEXTURES", save_mode="INTERNAL",
                                            use_clear=True, margin=max(size // 64, 4), uv_layer=name)
                    values = np.empty(size * size * image.channels, dtype=np.float32)
                    image.pixels.foreach_get(values)
                    images.append(values.reshape(size, size, image.channels)[..., :3].copy())
                finally:
                    for material in materials:
                        bpy.data.materials.remove(material)
                    for tree in trees:
                        bpy.data.node_groups.remove(tree)
                    bpy.data.images.remove(image)
            return images, coordinates.reshape(-1, 2)
        finally:
            bpy.data.objects.remove(ob)


def square(bounds, uv_names):
    """A square plane whose UV maps, named as asked, span `bounds` (u0, v0, u1, v1)."""
    mesh = bpy.data.meshes.new("smithwalk square")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [], [(0, 1, 2, 3)])
    u0, v0, u1, v1 = bounds
    for name in list(dict.fromkeys([*uv_names, "UVMap"]))[:7]:
        layer = mesh.uv_layers.new(name=name)
        layer.data.foreach_set("uv", [u0, v0, u1, v0, u1, v1, u0, v1])
    layer = mesh.uv_layers.new(name=_UV)
    layer.data.foreach_set("uv", [0, 0, 1, 0, 1, 1, 0, 1])
    mesh.uv_layers[0].active_render = True
    mesh.uv_layers.active = mesh.uv_layers[0]
    return mesh
