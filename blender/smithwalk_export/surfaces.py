"""Shader nodes to the materials of the scene format.

One function per node type returns a material as the format writes it, e.g.
`{"conductor": {"roughness": 0.5}}`. What varies in a way the format has no
word for was baked (bake.py); what has no counterpart is named in the log; a
surface that can't be carried at all becomes the magenta placeholder.
"""

import math

import bpy

from . import principled, relief
from .nodes import Graph, Texture, Unknown, dependencies, describe

PLACEHOLDER = {"diffuse": {"color": [1.0, 0.0, 1.0]}}
BLACK = {"diffuse": {"color": 0.0}}
NEW = bpy.app.version >= (4, 0, 0)
# Which of Cycles' models of the Diffuse node this Blender has.
DIFFUSE_VERSION = 4.5 if bpy.app.version >= (4, 3, 0) else 3.4


def _grey(rgb):
    """A colour as one number if it is grey, else as a list."""
    return rgb[0] if rgb[0] == rgb[1] == rgb[2] else list(rgb)


class Surface:
    """The translation of one material's node tree."""

    def __init__(self, writer, material, name, baked):
        self.writer = writer
        self.material = material
        self.name = name
        self.baked = baked
        self.graph = Graph(writer.audit)

    def _where(self, node=None):
        where = f'material "{self.material.name}"' if self.material else "the default material"
        return f"{where}, {describe(node)}" if node is not None else where

    def warn(self, what, node=None):
        """Name an approximation in this material."""
        self.writer.log.warn(self._where(node), what)

    def wrong(self, what, node=None):
        """Name something visibly wrong in this material."""
        self.writer.log.wrong(self._where(node), what)

    def note(self, what, node=None):
        """Name something mended."""
        self.writer.log.note(self._where(node), what)

    def translate(self):
        """The whole material."""
        material = self.material
        if material is None:
            return {"diffuse": {"color": 0.8}}
        if not material.use_nodes or material.node_tree is None:
            return {"diffuse": {"color": _grey(tuple(min(max(c, 0.0), 1.0) for c in material.diffuse_color[:3]))}}
        output = material.node_tree.get_output_node("CYCLES")
        if output is None:
            self.note("has no output: black, as in Cycles")
            return BLACK
        if output.inputs["Displacement"].is_linked:
            self.warn("displacement is left out")
        if output.inputs["Volume"].is_linked:
            if not output.inputs["Surface"].is_linked:
                self.wrong("a volume without a surface is left out: transparent")
                return {"transparent": {}}
        if not output.inputs["Surface"].is_linked:
            self.note("has no surface: black, as in Cycles")
            return BLACK
        surface = self.closure(output.inputs["Surface"], ())
        if output.inputs["Volume"].is_linked:
            surface = self.filled(surface, output.inputs["Volume"])
        for node, what in self.graph.lost():
            self.warn(f"{what}: left out", node)
        view = self.writer.audit.view(material)
        view.accept("use_nodes", "displacement_method", "cycles.displacement_method", "preview_render_type")
        for what in self.writer.audit.leftovers(material):
            self.warn(f"{what}: left out")
        return surface

    def filled(self, surface, socket):
        """A surface around the volume that feeds a socket: absorption alone is carried."""
        source = self.graph.follow(socket, ())
        if not source.linked or source.node.mute:
            return surface
        node = source.node
        if node.type != "VOLUME_ABSORPTION":
            self.warn(f"its volume is left out ({node.bl_label})")
            return surface
        self.graph.view(node)
        color, density = (self.value(node, name, source.groups) for name in ("Color", "Density"))
        if not isinstance(color, tuple) or not isinstance(density, float):
            self.warn("its volume is left out: absorption that differs from place to place")
            return surface
        absorption = tuple(max(1.0 - c, 0.0) * max(density, 0.0) for c in color[:3])
        return {"filled": {"surface": surface, "absorption": _grey(absorption)}} if any(absorption) else surface

    def closure(self, socket, groups):
        """The material that feeds a shader socket."""
        source = self.graph.follow(socket, groups)
        if not source.linked or source.node.mute:
            return BLACK  # an empty shader socket neither reflects nor emits
        if source.socket.type != "SHADER":
            return self._color_as_surface(socket, groups, source)  # as Cycles: emission of strength 1
        node = source.node
        translate = _CLOSURES.get(node.type)
        if translate is None:
            self.wrong(f"{node.bl_label} has no counterpart: magenta placeholder", node)
            return PLACEHOLDER
        self.graph.view(node)
        return translate(self, node, source.groups)

    def _color_as_surface(self, socket, groups, source):
        value = self.graph.evaluate(socket, groups) if source.socket.type in {"RGBA", "VALUE", "VECTOR"} else None
        if isinstance(value, tuple):
            return {"emission": {"color": _grey(tuple(max(c, 0.0) for c in value))}}
        if isinstance(value, float):
            return {"emission": {"color": max(value, 0.0)}}
        self.wrong("a colour stands where a shader belongs: magenta placeholder", source.node)
        return PLACEHOLDER

    # Values

    def value(self, node, name, groups):
        """A float, a tuple, `{"texture": …}` with a channel where the socket is a number,
        or Unknown; what can be baked was."""
        socket = node.inputs[name]
        value = self.graph.evaluate(socket, groups)
        if isinstance(value, Unknown):
            baked = self.baked.value(socket, groups)
            if isinstance(baked, tuple):
                return sum(baked) / 3.0 if socket.type == "VALUE" else baked
            if baked is not None:
                return {**baked, "channel": "r"} if socket.type == "VALUE" else baked
        if isinstance(value, Texture):
            texture = self.writer.texture(value, self._where())
            if texture is None:  # Cycles' colour of a missing image
                return Unknown(f'image "{value.image.name}"')
            if value.channel not in {None, "luminance"}:
                return {"texture": texture, "channel": value.channel}
            return {"texture": texture}
        if isinstance(value, Unknown) and "view" in dependencies(socket, groups):
            self.graph.head_on = True
            typical = self.graph.evaluate(socket, groups)
            self.graph.head_on = False
            if isinstance(typical, (float, tuple)):
                self.warn(f"{socket.name} depends on the view: its value seen head on is written", node)
                return typical
        return value

    def scalar(self, node, name, groups, low=None, high=None):
        """A number input: a float, or `{texture, channel}`."""
        value = self.value(node, name, groups)
        if isinstance(value, dict):
            return value
        label = node.inputs[name].name
        if isinstance(value, Unknown):
            used = float(node.inputs[name].default_value)
            self.wrong(f"{label} comes from {value.what}: replaced by {used:g}", node)
            value = used
        clamped = value if math.isfinite(value) else 0.0
        clamped = clamped if low is None else max(clamped, low)
        clamped = clamped if high is None else min(clamped, high)
        if clamped != value:
            self.note(f"{label} {value:g} is clamped to {clamped:g}", node)
        return clamped

    def color(self, node, name, groups, unit=True):
        """A colour input: a number, a list, or `{texture}`; magenta if it can't be carried."""
        value = self.value(node, name, groups)
        if isinstance(value, dict):
            peak = self.writer.peak(value["texture"]) if unit else 0.0
            if peak > 1.001:
                self.warn(f"{name} comes from an image with values up to {peak:.4g}: clamped to 1", node)
            return value
        if isinstance(value, Unknown):
            self.wrong(f"{name} comes from {value.what}: magenta placeholder", node)
            return [1.0, 0.0, 1.0]
        value = value if isinstance(value, tuple) else (value,) * 3
        high = 1.0 if unit else math.inf
        clamped = tuple(min(max(c, 0.0), high) if math.isfinite(c) else 0.0 for c in value)
        if clamped != value:
            shown = ", ".join(f"{c:.4g}" for c in value)
            self.warn(f"{name} ({shown}) is clamped to {'0…1' if unit else '0 and more'}", node)
        return _grey(clamped)

    def idle(self, node, *names):
        """These inputs say nothing here: they need no naming."""
        for name in names:
            if name in node.inputs:
                self.graph.follow(node.inputs[name])

    def distribution(self, node):
        """The format's distribution and scattering keys for a node's menu, and whether α = 0."""
        choice = self.graph.view(node).distribution
        if choice == "MULTI_GGX":
            return {}, False
        if choice == "ASHIKHMIN_SHIRLEY":
            self.warn("Ashikhmin-Shirley is written as single-scattering GGX", node)
        if choice == "SHARP":
            return {}, True
        keys = {"distribution": "beckmann"} if choice == "BECKMANN" else {}
        return {**keys, "scattering": "single"}, False

    def tell_scaling(self, node):
        """What Cycles does to anisotropic surfaces instead of following light from facet to facet."""
        if NEW and node.distribution == "MULTI_GGX":
            self.warn("its Multiscatter GGX is scaled in Cycles by the albedo of an isotropic surface, which "
                      "loses some light: here none is lost", node)

    def tangent(self, node, groups):
        """The `tangent` key of an anisotropic node."""
        source = self.graph.follow(node.inputs["Tangent"], groups)
        if source.linked and source.node.type == "TANGENT":
            view = self.graph.view(source.node)
            view.accept("axis")
            if view.direction_type == "UV_MAP":
                if not self.writer.is_own(view.uv_map or None):
                    self.warn(f'tangent along UV map "{view.uv_map}": each mesh\'s active one is taken', node)
                return {}  # uv is the default
            axis = source.node.axis.lower()
        else:
            if source.linked:
                self.warn(f"tangent comes from {source.node.bl_label}: radial z is written", node)
            axis = "z"
        self.writer.radial_axes[self.name].add(axis)
        return {"tangent": {"radial": axis}}

    def rough(self, node, groups):
        """The rough keys of a Glossy, Anisotropic, Metallic or Glass node."""
        keys, sharp = self.distribution(node)
        keys.update(relief.keys(self, node, groups))
        if sharp:
            self.idle(node, "Roughness", "Anisotropy", "Rotation", "Tangent")
            return {**keys, "alpha": 0.0}
        keys["roughness"] = self.scalar(node, "Roughness", groups, 0.0, 1.0)
        if "Anisotropy" in node.inputs and node.inputs["Anisotropy"].enabled:
            anisotropy = self.scalar(node, "Anisotropy", groups, -1.0, 1.0)
            if anisotropy != 0.0:
                keys["anisotropy"] = anisotropy
                self.tell_scaling(node)
                rotation = self.turns(node, "Rotation", groups)
                if rotation != 0.0:
                    keys["rotation"] = rotation
                keys.update(self.tangent(node, groups))
            else:
                self.idle(node, "Rotation", "Tangent")
        return keys

    # Closures

    def diffuse(self, node, groups):
        """Diffuse BSDF: Lambert, or Oren and Nayar's."""
        keys = {"color": self.color(node, "Color", groups), **relief.keys(self, node, groups)}
        roughness = self.scalar(node, "Roughness", groups, 0.0, 1.0)
        if roughness != 0.0:
            keys.update(roughness=roughness, version=DIFFUSE_VERSION)
        return {"diffuse": keys}

    def glossy(self, node, groups):
        """Glossy and Anisotropic BSDF: the colour multiplies at every facet."""
        keys = self.rough(node, groups)
        return {"conductor": {**keys, "color": self.color(node, "Color", groups)}}

    def metallic(self, node, groups):
        """Metallic BSDF (4.3 and newer): complex IOR, or F82 tint."""
        keys = self.rough(node, groups)
        if self.graph.view(node).fresnel_type == "PHYSICAL_CONDUCTOR":
            return {"conductor": {**keys, "eta": self.color(node, "IOR", groups, unit=False),
                                  "k": self.color(node, "Extinction", groups, unit=False)}}
        f0 = self.color(node, "Base Color", groups)
        tint = self.color(node, "Edge Tint", groups)
        return {"conductor": {**keys, "f0": f0, **({"edge_tint": tint} if tint != 1.0 else {})}}

    def turns(self, node, name, groups):
        """A rotation: whole turns change nothing."""
        value = self.scalar(node, name, groups)
        return value if isinstance(value, dict) else value % 1.0

    def ior(self, node, groups):
        """An index of refraction; Cycles keeps it above 0."""
        return self.scalar(node, "IOR", groups, 1e-3)

    def glass(self, node, groups):
        """Glass BSDF."""
        return {"dielectric": {**self.rough(node, groups), "ior": self.ior(node, groups),
                               "color": self.color(node, "Color", groups)}}

    def refraction(self, node, groups):
        """Refraction BSDF."""
        return {"refraction": {**self.rough(node, groups), "ior": self.ior(node, groups),
                               "color": self.color(node, "Color", groups)}}

    def emission(self, node, groups):
        """Emission: radiance = colour · strength, W·m⁻²·sr⁻¹."""
        strength = self.scalar(node, "Strength", groups, 0.0)
        return {"emission": {"color": self.color(node, "Color", groups, unit=False), "strength": strength}}

    def transparent(self, node, groups):
        """Transparent BSDF."""
        return {"transparent": {"color": self.color(node, "Color", groups)}}

    def translucent(self, node, groups):
        """Translucent BSDF."""
        return {"translucent": {"color": self.color(node, "Color", groups), **relief.keys(self, node, groups)}}

    def velvet(self, node, groups):
        """Velvet BSDF (3.x)."""
        return {"velvet": {"color": self.color(node, "Color", groups),
                           "sigma": self.scalar(node, "Sigma", groups, 0.0, 1.0),
                           **relief.keys(self, node, groups)}}

    def sheen(self, node, groups):
        """Sheen BSDF (4.0 and newer)."""
        if self.graph.view(node).distribution == "ASHIKHMIN":
            return {"velvet": {"color": self.color(node, "Color", groups),
                               "sigma": self.scalar(node, "Roughness", groups, 0.0, 1.0),
                               **relief.keys(self, node, groups)}}
        return {"sheen": {"color": self.color(node, "Color", groups),
                          "roughness": self.scalar(node, "Roughness", groups, 0.0, 1.0),
                          **relief.keys(self, node, groups)}}

    def subsurface(self, node, groups):
        """Subsurface Scattering: light that comes out where it went in."""
        self.warn("light comes out where it went in: written as diffuse of the same colour", node)
        self.graph.view(node).accept("falloff")
        self.idle(node, "Scale", "Radius", "IOR", "Anisotropy", "Roughness")
        return {"diffuse": {"color": self.color(node, "Color", groups), **relief.keys(self, node, groups)}}

    def holdout(self, node, groups):
        """Holdout: a hole in the picture; black here."""
        self.warn("a holdout is written as black", node)
        return BLACK

    def mix(self, node, groups):
        """Mix Shader."""
        factor, swapped = self.factor(node.inputs[0], groups, node)
        first, second = (node.inputs[2], node.inputs[1]) if swapped else (node.inputs[1], node.inputs[2])
        if factor == 0.0:
            self.graph.follow(second)
            return self.closure(first, groups)
        if factor == 1.0:
            self.graph.follow(first)
            return self.closure(second, groups)
        return {"mix": {"factor": factor, "a": self.closure(first, groups), "b": self.closure(second, groups)}}

    def factor(self, socket, groups, node):
        """A mix's factor as the format writes it, and whether a and b change places."""
        source = self.graph.follow(socket, groups)
        if source.linked and not source.node.mute:
            node_of = source.node
            view = self.graph.view(node_of)
            if node_of.type == "FRESNEL":
                return {"fresnel": {"ior": self.ior(node_of, source.groups)}}, False
            if node_of.type == "LAYER_WEIGHT":
                blend = self.scalar(node_of, "Blend", source.groups, 0.0, 1.0)
                if source.socket.name == "Facing":
                    return {"facing": {"blend": blend}}, False
                if isinstance(blend, float):
                    return {"fresnel": {"ior": 1.0 / max(1.0 - blend, 1e-3)}}, False
            if node_of.type == "NEW_GEOMETRY" and source.socket.name == "Backfacing":
                return "backfacing", False
            if node_of.type == "LIGHT_PATH" and source.socket.name == "Is Camera Ray":
                return "camera_ray", False
            if node_of.type == "INVERT" or (node_of.type == "MATH" and view.operation == "SUBTRACT"):
                through = node_of.inputs[1]
                whole = self.graph.evaluate(node_of.inputs[0], source.groups)
                if whole == 1.0 and "view" in dependencies(through, source.groups):
                    view.accept("use_clamp")
                    factor, swapped = self.factor(through, source.groups, node)
                    return factor, not swapped
        return self.scalar(node, 0, groups, 0.0, 1.0), False

    def add(self, node, groups):
        """Add Shader; an empty side changes nothing."""
        sides = [s for s in node.inputs if self.graph.follow(s, groups).linked]
        if not sides:
            return BLACK
        if len(sides) == 1:
            return self.closure(sides[0], groups)
        return {"sum": {"a": self.closure(sides[0], groups), "b": self.closure(sides[1], groups)}}


_CLOSURES = {
    "BSDF_DIFFUSE": Surface.diffuse,
    "BSDF_GLOSSY": Surface.glossy,
    "BSDF_ANISOTROPIC": Surface.glossy,
    "BSDF_METALLIC": Surface.metallic,
    "BSDF_GLASS": Surface.glass,
    "BSDF_REFRACTION": Surface.refraction,
    "BSDF_TRANSPARENT": Surface.transparent,
    "BSDF_TRANSLUCENT": Surface.translucent,
    "BSDF_VELVET": Surface.velvet,
    "BSDF_SHEEN": Surface.sheen,
    "SUBSURFACE_SCATTERING": Surface.subsurface,
    "BSDF_PRINCIPLED": principled.translate,
    "EMISSION": Surface.emission,
    "HOLDOUT": Surface.holdout,
    "MIX_SHADER": Surface.mix,
    "ADD_SHADER": Surface.add,
}
