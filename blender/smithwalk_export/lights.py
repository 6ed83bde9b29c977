"""Lights and the camera.

Blender's light power stays in watts: `light_units` tells the renderer how the
Cycles of this Blender turns watts into radiance (3.x and 4.x differ).
"""

import math

import bpy
from mathutils import Vector

from .images import mean_color
from .meshes import FARTHEST
from .nodes import Graph, Unknown, describe

# The smallest size and angle that are written for 0: Cycles uses a tiny area then.
_TINY = 1e-4


def matrix(m):
    """A transform: four rows of four numbers, object to world."""
    return {"matrix": [[float(x) for x in row] for row in m]}


def is_finite(m):
    """Whether all of a matrix is finite, and not beyond what single precision can square."""
    return all(abs(x) <= FARTHEST for row in m for x in row)


def light_units():
    """Which Cycles this Blender carries: area light and spot radiometry changed in 4.0."""
    return "cycles_3" if bpy.app.version < (4, 0, 0) else "cycles_4"


def rigid(m):
    """The same place and direction with axes of length 1: what a light or camera needs."""
    location, rotation, _ = m.decompose()
    return rotation.to_matrix().to_4x4(), location


# The kinds of rays that objects may be hidden from, beside the camera's.
RAYS = ("diffuse", "glossy", "transmission", "shadow")


def hidden_from(ob):
    """The rays that pass an object, beside the camera's; of a light, those that have a say."""
    return [kind for kind in RAYS if not getattr(ob, f"visible_{kind}")
            and not (ob.type == "LIGHT" and kind == "shadow")]


class LightWriter:
    """Turns light objects into lights of the scene format."""

    def __init__(self, audit, log):
        self.audit = audit
        self.log = log

    def add(self, ob, world_matrix):
        """One light, from an evaluated light object; None where nothing shines."""
        where = f'light "{ob.name}"'
        data = self.audit.view(ob.data)
        data.accept("node_tree", "use_nodes", "color", "energy", "shape", "size", "size_y", "spread", "angle",
                    "spot_size", "spot_blend", "shadow_soft_size", "use_shadow_jitter", "show_cone",
                    "use_square", "cycles.use_multiple_importance_sampling", "cycles.is_portal",
                    "cycles.cast_shadow", "use_shadow", "cycles.max_bounces")
        if not is_finite(world_matrix):
            self.log.note(where, "its matrix is not finite: left out")
            return None
        if getattr(ob.data.cycles, "is_portal", False):
            self.log.note(where, "a portal guides samples and is no light: left out")
            return None
        rgb, power = self._emission(ob.data, where)
        power *= 2.0 ** data.get("exposure", 0.0)
        if power < 0.0 or min(rgb) < 0.0:
            self.log.wrong(where, "shines negatively in Blender (it takes light away): left out")
            return None
        if power == 0.0 or max(rgb) == 0.0 or not math.isfinite(power):
            return None
        keys = {"name": ob.name, "transform": matrix(world_matrix)}
        if abs(world_matrix.to_3x3().determinant()) < 1e-12:
            keys["transform"] = matrix(_unscaled(world_matrix))
        if rgb != [1.0, 1.0, 1.0]:
            keys["color"] = rgb
        if ob.visible_camera:
            keys["visible_to_camera"] = True
        if hidden_from(ob):
            keys["hidden_from"] = hidden_from(ob)
        if not getattr(ob.data, "use_shadow", True) and bpy.app.version >= (4, 0, 0) \
                or not getattr(ob.data.cycles, "cast_shadow", True):
            self.log.warn(where, "casts shadows here though not in Blender")
        if getattr(ob.data.cycles, "max_bounces", 1024) < 1024:
            self.log.warn(where, f"its limit of {ob.data.cycles.max_bounces} bounces is left out")

        if ob.data.type == "SUN":
            entry = {"sun": {**keys, "strength": power, "angle": math.degrees(min(max(data.angle, 0.0), math.pi))}}
        elif ob.data.type == "AREA":
            entry = {"area": self._area(data, keys, power, world_matrix, where)}
        else:
            entry = self._point(data, keys, power, where)
        for text in self.audit.leftovers(ob.data):
            self.log.warn(where, f"{text}: left out")
        return entry

    def _point(self, data, keys, power, where):
        if not data.get("normalize", True):
            # L = P/4π whatever the size: the power of a normalised light (P/(4π²r²)) of that radiance.
            radius = max(data.shadow_soft_size, 0.0)
            power *= math.pi * radius * radius if radius > 0.0 else 1.0
        radius = max(data.shadow_soft_size, 0.0)
        if radius > 0.0:
            keys["radius"] = radius
        keys["power"] = power
        soft = data.get("use_soft_falloff", True)
        if data.type == "SPOT":
            if not soft and radius > 0.0:
                self.log.warn(where, "soft falloff off has no counterpart for spots")
            keys.update(size=min(max(math.degrees(data.spot_size), 0.01), 180.0),
                        blend=min(max(data.spot_blend, 0.0), 1.0))
            scale = [a.length for a in _columns(keys["transform"]["matrix"])]
            if max(scale) - min(scale) > 1e-3 * max(scale):
                self.log.warn(where, "its scale makes the cone elliptic in Blender: round here")
            return {"spot": keys}
        if not soft:
            keys["soft_falloff"] = False
        return {"point": keys}

    def _area(self, data, keys, power, world_matrix, where):
        width = data.size
        height = data.size_y if data.shape in {"RECTANGLE", "ELLIPSE"} else data.size
        shape = "disk" if data.shape in {"DISK", "ELLIPSE"} else "rectangle"
        if min(width, height) <= 0.0 or abs(world_matrix.to_3x3().determinant()) < 1e-12:
            self.log.note(where, f"has no area: {_TINY:g} m are written")
            width, height = max(width, _TINY), max(height, _TINY)
        if not data.get("normalize", True):
            # L = P/π whatever the size: the power of a light of that radiance.
            x, y = (world_matrix.to_3x3().col[i] for i in (0, 1))
            power *= x.cross(y).length * width * height * (math.pi / 4.0 if shape == "disk" else 1.0)
        keys.update(shape={shape: {"width": width, "height": height}}, power=power)
        spread = data.get("spread", math.pi)
        if spread < math.pi * (1.0 - 1e-6):
            keys["spread"] = max(math.degrees(spread), 0.01)
        return keys

    def _emission(self, data, where):
        """Colour and power of a light, with constant Emission nodes folded in."""
        rgb = [float(c) for c in data.color]
        power = float(data.energy)
        view = self.audit.view(data)
        if view.get("use_temperature"):  # 4.5 and newer
            view.accept("temperature", "temperature_color")
            rgb = [c * t for c, t in zip(rgb, data.temperature_color)]
        tree = data.node_tree if data.use_nodes else None
        output = tree.get_output_node("CYCLES") if tree else None
        if tree is not None and output is None:
            return rgb, 0.0
        if output:
            graph = Graph(self.audit)
            tint = self._closure(graph, output.inputs["Surface"], (), where)
            for node, what in graph.lost():
                self.log.warn(f"{where}, {describe(node)}", f"{what}: left out")
            peak = max(tint)
            if peak > 0.0 and min(tint) >= 0.0:  # what all channels have in common is power
                tint, power = [t / peak for t in tint], power * peak
            rgb = [c * t for c, t in zip(rgb, tint)]
        return rgb, power

    def _closure(self, graph, socket, groups, where):
        """What a shader socket multiplies the light by, per channel."""
        source = graph.follow(socket, groups)
        if not source.linked:
            return (0.0, 0.0, 0.0)
        node = source.node
        graph.view(node)
        if node.type == "EMISSION":
            strength = self._strength(graph, node.inputs["Strength"], source.groups, where)
            tint = graph.evaluate(node.inputs["Color"], source.groups)
            if not isinstance(tint, tuple):
                what = tint.what if isinstance(tint, Unknown) else f'image "{tint.image.name}"'
                mean = None if isinstance(tint, Unknown) else mean_color(tint.image)
                kept = "the power" if mean is None else "its mean"
                self.log.warn(where, f"its colour comes from {what}: {kept} is kept, the pattern is not")
                tint = mean or (1.0, 1.0, 1.0)
            return tuple(t * strength for t in tint)
        if node.type == "MIX_SHADER":
            factor = graph.evaluate(node.inputs[0], source.groups)
            if not isinstance(factor, float):
                factor = 0.5
                self.log.warn(where, "a mix that depends on the ray or the place is written half and half")
            factor = min(max(factor, 0.0), 1.0)
            a, b = (self._closure(graph, s, source.groups, where) for s in node.inputs[1:3])
            return tuple(x * (1.0 - factor) + y * factor for x, y in zip(a, b))
        if node.type == "ADD_SHADER":
            a, b = (self._closure(graph, s, source.groups, where) for s in node.inputs[:2])
            return tuple(x + y for x, y in zip(a, b))
        self.log.warn(where, f"{describe(node)} is no Emission: power and colour are kept")
        return (1.0, 1.0, 1.0)

    def _strength(self, graph, socket, groups, where):
        value = graph.evaluate(socket, groups)
        if isinstance(value, float):
            return value
        source = graph.follow(socket, groups)
        if source.linked and source.node.type == "LIGHT_FALLOFF":
            graph.view(source.node)
            strength = graph.read(source, "Strength")
            smooth = graph.read(source, "Smooth")
            if isinstance(strength, float):
                kind = source.socket.name
                if kind != "Quadratic" or smooth != 0.0:
                    self.log.warn(where, f"its falloff ({kind.lower()}, smooth {smooth:g}) is written as "
                                         "quadratic, of the same power at 1 m")
                return strength
        what = value.what if isinstance(value, Unknown) else f'image "{value.image.name}"'
        self.log.warn(where, f"its strength comes from {what}: the power is kept, the pattern is not")
        return 1.0


def _columns(rows):
    return [Vector((rows[0][i], rows[1][i], rows[2][i])) for i in range(3)]


def _unscaled(m):
    """A matrix without scale: place and direction are all that is left of a collapsed light."""
    rotation, location = rigid(m)
    rotation.translation = location
    return rotation


def camera(scene, depsgraph, audit, log):
    """The camera section."""
    if scene.camera is None:
        log.wrong("scene", "has no camera (Cycles does not render it): one 10 m before the origin is written")
        return {"transform": {"look_at": {"from": [0.0, -10.0, 3.0], "to": [0.0, 0.0, 0.0]}},
                "projection": {"perspective": {"lens": 50.0}}}
    ob = scene.camera.evaluated_get(depsgraph)
    data, render = audit.view(ob.data), scene.render
    where = f'camera "{ob.name}"'
    data.accept("angle", "angle_x", "angle_y", "lens_unit", "display_size", "lens", "sensor_height", "ortho_scale")
    shift = {f"shift_{axis}": getattr(data, f"shift_{axis}") for axis in "xy"
             if getattr(data, f"shift_{axis}") != 0.0}
    fit = {} if data.sensor_fit == "AUTO" else {"sensor_fit": data.sensor_fit.lower()}
    aspect = render.pixel_aspect_y / render.pixel_aspect_x
    lens = max(data.lens, 1e-3)
    if data.type == "ORTHO":
        projection = {"orthographic": {"scale": max(data.ortho_scale, 1e-6), **fit, **shift}}
        if aspect != 1.0:
            log.warn(where, "pixel aspect is left out of an orthographic camera")
    else:
        keys = {"lens": lens, "sensor_width": max(data.sensor_width, 1e-3),
                "sensor_height": max(data.sensor_height, 1e-3), **fit, **shift}
        if aspect != 1.0:
            keys["pixel_aspect"] = aspect
        projection = {"perspective": keys}
        if data.type != "PERSP":
            log.wrong(where, f"a {data.type.lower()} camera is written as perspective")
            for name in [p.identifier for p in ob.data.bl_rna.properties]:
                if name.startswith(("panorama", "fisheye", "latitude", "longitude", "central", "cycles", "custom")):
                    data.accept(name)
    m = ob.matrix_world
    if not is_finite(m):
        log.wrong(where, "its matrix is not finite: the origin is written")
        section = {"transform": {"location": [0.0, 0.0, 0.0]}, "projection": projection}
    else:
        m = m if abs(m.to_3x3().determinant()) > 1e-12 else _unscaled(m)
        section = {"transform": matrix(m), "projection": projection}

    near, far = max(data.clip_start, 0.0), data.clip_end
    if _clips(depsgraph, ob, near, far):
        section["clip"] = [near, max(far, near + 1e-6)]
    dof = data.dof
    if dof.use_dof:
        distance = dof.focus_distance
        if dof.focus_object and is_finite(ob.matrix_world):
            target = dof.focus_object.evaluated_get(depsgraph)
            point = target.matrix_world.translation
            if dof.get("focus_subtarget"):
                bone = target.pose.bones.get(dof.focus_subtarget) if target.pose else None
                point = target.matrix_world @ bone.head if bone else point
            axis = ob.matrix_world.to_3x3().col[2].normalized()
            distance = abs(axis.dot(point - ob.matrix_world.translation))
        # Cycles keeps the f-number away from 0 (Blender's own lower end is 0.1).
        fstop = dof.aperture_fstop
        if fstop < 1e-5:
            log.note(where, "f-stop 0 is written as 1e-5, as Cycles takes it")
            fstop = 1e-5
        section["depth_of_field"] = {"fstop": fstop, "focus_distance": max(distance, 1e-5)}
        if dof.aperture_blades >= 3 or dof.aperture_ratio != 1.0:
            log.warn(where, "bokeh blades and ratio are left out: a round aperture")
        dof.accept("aperture_rotation")
    else:
        data.accept("dof")
    for text in audit.leftovers(ob.data):
        log.warn(where, f"{text}: left out")
    return section


def _clips(depsgraph, camera_ob, near, far):
    """Whether a clip range cuts into the scene."""
    if not is_finite(camera_ob.matrix_world):
        return False
    to_camera = _unscaled(camera_ob.matrix_world).inverted()
    for instance in depsgraph.object_instances:
        ob = instance.object
        if ob.type != "MESH" or not instance.show_self or not is_finite(instance.matrix_world):
            continue
        depths = [-(to_camera @ instance.matrix_world @ Vector(c)).z for c in ob.bound_box]
        if max(depths) > far or min(depths) < near and max(depths) > 0.0:
            return True
    return False
