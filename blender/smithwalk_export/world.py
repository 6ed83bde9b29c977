"""The world: a constant, an image as it is, or a panorama rendered by Cycles.

A sky's sun disk is too small for a panorama: it becomes a sun of the same
irradiance and angle.
"""

import contextlib
import math

import bpy
import numpy as np
from mathutils import Matrix, Vector

from . import cycles
from .bake import uniform
from .lights import matrix
from .nodes import Graph, LINEAR_SPACES, describe, link_into

_WIDTH = 1024       # of what no image gives more detail
_LARGEST_WIDTH = 4096  # of an image that is followed


class WorldWriter:
    """The world section, and the sun that a sky's disk becomes."""

    def __init__(self, scene, view_layer, audit, log, enabled, progress):
        self.scene = scene
        self.data = getattr(view_layer, "world_override", None) or scene.world
        self.audit = audit
        self.log = log
        self.enabled = enabled
        self.progress = progress
        self.panorama = None   # (pixels, sun or None)
        self.backdrop = None   # the one colour that the camera sees, where that is not what lights the scene
        self.where = f'world "{self.data.name}"' if self.data else "world"

    def prepare(self):
        """Render the panorama, if one is needed, outside of any other render."""
        if self.data is None or self._plain(None) is not None:
            return
        tree = self.data.node_tree
        cache = cycles.Cache()
        key = cache.key("world", _WIDTH, cycles.fingerprint(tree))
        stored = cache.get(key)
        if stored is None and self.enabled:
            self.progress("rendering the world", 0.0)
            stored = self._render(tree)
            cache.put(key, **stored)
        if stored is not None:
            sun = tuple(float(x) for x in stored["sun"]) if "sun" in stored else None
            self.panorama = (stored["pixels"], sun)
        if self._sees_camera_rays():
            key = cache.key("backdrop", cycles.fingerprint(tree))
            seen = cache.get(key)
            if seen is None and self.enabled:
                with self._copy(camera=1.0) as world:
                    seen = {"pixels": self._panorama(world, 64)}
                cache.put(key, **seen)
            self.backdrop = None if seen is None else uniform(seen["pixels"])

    def section(self, images):
        """The world section (None: black) and the list of extra lights."""
        if self.data is None:
            return None, []
        plain = self._plain(images)
        view = self.audit.view(self.data)
        view.accept("color", "use_nodes", "node_tree", "cycles.is_caustics_light")
        visibility = getattr(self.data, "cycles_visibility", None)
        kinds = ("camera", "diffuse", "glossy", "transmission")
        hidden = [kind for kind in kinds if not getattr(visibility, kind, True)]
        seen = {"hidden_from": hidden} if hidden else {}
        view.accept("cycles_visibility")
        for what in self.audit.leftovers(self.data):
            self.log.warn(self.where, f"{what}: left out")
        if plain is not None:
            for keys in plain.values():
                keys.update(seen)
            return plain or None, []
        if self.panorama is None:
            rgb = [max(float(c), 0.0) for c in self.data.color]
            self.log.wrong(self.where, "its nodes need a panorama by Cycles, which was not rendered: "
                                       f"the viewport colour {[round(c, 3) for c in rgb]} is written")
            return {"constant": {"color": rgb, **seen}}, []
        pixels, sun = self.panorama
        if self._sees_camera_rays() and self.backdrop is None:
            self.log.warn(self.where, "looks different to the camera than to light in Blender: "
                                      "what lights the scene is written")
        lights = [self._sun(sun, hidden)] if sun else []
        constant = uniform(pixels)
        if constant is not None:
            return {"constant": {"color": list(constant), **seen}}, lights
        rgba = np.ones((*pixels.shape[:2], 4), dtype=np.float32)
        rgba[..., :3] = pixels
        file = images.save(rgba, "world", True, self.where)
        return {"environment": {"file": file, **seen}} if file else None, lights

    # A constant, or an image

    def _plain(self, images):
        """The section without a panorama, {} for black, or None when one is needed.

        Without `images` nothing is written or told: only whether one is needed counts.
        """
        data = self.data
        log = self.log if images is not None else None
        if not data.use_nodes or data.node_tree is None:
            return {"constant": {"color": [max(float(c), 0.0) for c in data.color]}}
        output = data.node_tree.get_output_node("CYCLES")
        if output is None:
            return {}
        if output.inputs["Volume"].is_linked and log:
            log.warn(self.where, "its volume is left out")
        graph = Graph(self.audit)
        source = graph.follow(output.inputs["Surface"])
        if not source.linked:
            return {}
        if source.node.type not in {"BACKGROUND", "EMISSION"} or source.node.mute:
            return None
        graph.view(source.node)
        strength = graph.read(source, "Strength")
        if not isinstance(strength, float):
            return None
        if strength < 0.0:
            if log:
                log.wrong(self.where, f"a negative strength ({strength:g}) is written as 0")
            strength = 0.0
        rgb = graph.read(source, "Color")
        if isinstance(rgb, tuple):
            return {"constant": {"color": [max(c, 0.0) for c in rgb], "strength": strength}}
        return self._environment(graph, source, strength, images)

    def _environment(self, graph, source, strength, images):
        below = graph.follow(source.node.inputs["Color"], source.groups)
        if not below.linked or below.node.type != "TEX_ENVIRONMENT" or below.node.mute:
            return None
        view = graph.view(below.node)
        image = view.image
        view.accept("image_user")
        if image is None or view.projection != "EQUIRECTANGULAR" or view.interpolation != "Linear" \
                or not image.is_float or image.source != "FILE" \
                or image.colorspace_settings.name not in LINEAR_SPACES:
            return None
        keys = {"strength": strength}
        vector = graph.follow(below.node.inputs["Vector"], below.groups)
        if vector.linked and vector.node.type == "MAPPING":
            mapping = graph.view(vector.node)
            location, rotation, scale = (graph.read(vector, n) for n in ("Location", "Rotation", "Scale"))
            if not all(isinstance(v, tuple) for v in (location, rotation, scale)) \
                    or mapping.vector_type not in {"POINT", "VECTOR"} or scale != (1.0, 1.0, 1.0) \
                    or any(location) and mapping.vector_type == "POINT":
                return None
            if any(rotation):
                keys["rotation"] = [math.degrees(a) for a in rotation]
            vector = graph.follow(vector.node.inputs["Vector"], vector.groups)
            if not vector.linked:
                return None
        if vector.linked and not (vector.node.type == "TEX_COORD" and vector.socket.name == "Generated"):
            return None
        if images is None:
            return keys
        for node, what in graph.lost():
            self.log.warn(f"{self.where}, {describe(node)}", f"{what}: left out")
        file = images.add(image, self.where)
        return {"environment": {"file": file, **keys}} if file else {"constant": {"color": [1.0, 0.0, 1.0]}}

    # A panorama

    def _render(self, tree):
        width = max([_WIDTH] + [min(i.size[0], _LARGEST_WIDTH) for i in _images(tree)])
        with self._copy() as world:
            sky = [n for n in _all_nodes(world.node_tree) if n.type == "TEX_SKY" and getattr(n, "sun_disc", False)
                   and n.sky_type not in {"PREETHAM", "HOSEK_WILKIE"}]
            with_sun = self._panorama(world, width) if sky else None
            for node in sky:
                node.sun_disc = False
            pixels = self._panorama(world, width)
            stored = {"pixels": pixels}
            if sky:
                sun = self._measure_sun(world, sky, with_sun - pixels)
                if sun:
                    stored["sun"] = np.array(sun, dtype=np.float64)
        return stored

    @contextlib.contextmanager
    def _copy(self, camera=0.0):
        """The world as light sees it, or for `camera` 1 as the camera does; visible to all."""
        world = self.data.copy()
        before = set(bpy.data.node_groups)
        try:
            _copy_groups(world.node_tree)
            if hasattr(world, "cycles_visibility"):
                world.cycles_visibility.camera = True
            for tree in _all_trees(world.node_tree):
                for node in tree.nodes:
                    if node.type == "LIGHT_PATH":
                        for link in list(node.outputs["Is Camera Ray"].links):
                            target = link.to_socket
                            tree.links.remove(link)
                            value = tree.nodes.new("ShaderNodeValue")
                            value.outputs[0].default_value = camera
                            tree.links.new(value.outputs[0], target)
            yield world
        finally:
            bpy.data.worlds.remove(world)
            for tree in set(bpy.data.node_groups) - before:
                bpy.data.node_groups.remove(tree)

    def _panorama(self, world, width):
        def aim(data):
            data.type = "PANO"
            for owner in filter(None, (data, getattr(data, "cycles", None))):
                if hasattr(owner, "panorama_type"):
                    owner.panorama_type = "EQUIRECTANGULAR"
        # Blender's environment lookup has +x in the middle, up is z.
        return _photograph(world, aim, Matrix.Rotation(-math.pi / 2, 4, "Z")
                           @ Matrix.Rotation(math.pi / 2, 4, "X"), width, width // 2, 4)

    def _measure_sun(self, world, sky, difference):
        """Direction, irradiance and angle of the sky's sun disk; None when it is below the horizon."""
        height, width, _ = difference.shape
        v = (np.arange(height) + 0.5) / height
        theta = (v - 0.5) * math.pi  # bottom row first
        phi = (0.5 - (np.arange(width) + 0.5) / width) * 2.0 * math.pi
        weight = np.maximum(difference.sum(axis=2), 0.0) * np.cos(theta)[:, None]
        weight[weight < 0.01 * weight.max()] = 0.0
        if weight.sum() <= 0.0:
            return None
        cos = np.cos(theta)[:, None]
        direction = Vector((float((weight * cos * np.cos(phi)).sum()), float((weight * cos * np.sin(phi)).sum()),
                            float((weight * np.sin(theta)[:, None]).sum()))).normalized()
        angle = sky[0].sun_size
        fov = min(max(angle * 1.6, math.radians(0.5)), math.radians(60.0))

        def aim(data):
            data.type = "PERSP"
            data.sensor_fit = "HORIZONTAL"
            data.angle = fov
        pose = direction.to_track_quat("Z", "Y").to_matrix().to_4x4() @ Matrix.Rotation(math.pi, 4, "Y")
        size = 128
        without = _photograph(world, aim, pose, size, size, 16)
        for node in sky:
            node.sun_disc = True
        seen = _photograph(world, aim, pose, size, size, 16)
        step = 2.0 * math.tan(fov / 2.0) / size
        x = (np.arange(size) + 0.5) * step - math.tan(fov / 2.0)
        solid = step * step / (1.0 + x[:, None] ** 2 + x[None, :] ** 2) ** 1.5
        irradiance = np.maximum(seen - without, 0.0).astype(np.float64) * solid[..., None]
        irradiance = irradiance.sum(axis=(0, 1))
        if irradiance.max() <= 0.0:
            return None
        return (*direction, *irradiance, angle)

    @staticmethod
    def _sun(sun, hidden):
        x, y, z, r, g, b, angle = sun
        strength = max(r, g, b)
        pose = Vector((x, y, z)).to_track_quat("Z", "Y").to_matrix().to_4x4()
        keys = {"name": "Sun disk of the sky", "transform": matrix(pose),
                "color": [r / strength, g / strength, b / strength],
                "strength": strength, "angle": math.degrees(angle)}
        if "camera" not in hidden:
            keys["visible_to_camera"] = True
        others = [kind for kind in hidden if kind != "camera"]
        if others:
            keys["hidden_from"] = others
        return {"sun": keys}

    def _sees_camera_rays(self):
        return any(n.type == "LIGHT_PATH" and link_into_any(n.outputs["Is Camera Ray"])
                   for n in _all_nodes(self.data.node_tree))


def link_into_any(output):
    """Whether an output is used."""
    return any(l.is_valid and link_into(l.to_socket) is not None for l in output.links)


def _all_trees(tree):
    yield tree
    for node in tree.nodes:
        if node.type == "GROUP" and node.node_tree:
            yield from _all_trees(node.node_tree)


def _all_nodes(tree):
    for inner in _all_trees(tree):
        yield from list(inner.nodes)


def _images(tree):
    return [n.image for n in _all_nodes(tree) if getattr(n, "image", None) is not None]


def _copy_groups(tree):
    for node in tree.nodes:
        if node.type == "GROUP" and node.node_tree:
            node.node_tree = node.node_tree.copy()
            _copy_groups(node.node_tree)


def _photograph(world, aim, pose, width, height, samples):
    """An empty scene in this world, seen by a camera: (height, width, 3), bottom row first."""
    with cycles.temporary_scene(samples) as scene:
        data = bpy.data.cameras.new("smithwalk")
        ob = bpy.data.objects.new("smithwalk", data)
        try:
            scene.collection.objects.link(ob)
            aim(data)
            ob.matrix_world = pose
            scene.camera = ob
            scene.world = world
            render = scene.render
            render.resolution_x, render.resolution_y, render.resolution_percentage = width, height, 100
            return cycles.render_exr(scene)[..., :3].copy()
        finally:
            bpy.data.objects.remove(ob)
            bpy.data.cameras.remove(data)
