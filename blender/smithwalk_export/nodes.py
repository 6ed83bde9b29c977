"""What feeds a socket: a constant, an image texture, or something else.

Links are followed through reroutes, muted nodes and node groups. Chains of
constant nodes (Value, RGB, Math, …) are folded.
"""

import math
from dataclasses import dataclass, replace

import bpy


@dataclass(frozen=True)
class Texture:
    """An image lookup. `channel` is None for the colour, else r, g, b, a or luminance."""

    image: bpy.types.Image
    color_space: str = "srgb"
    interpolation: str = "bilinear"
    scale: tuple = (1.0, 1.0)
    offset: tuple = (0.0, 0.0)
    channel: str = None


@dataclass(frozen=True)
class Unknown:
    """Something the scene format has no word for; `what` names it."""

    what: str


@dataclass(frozen=True)
class Source:
    """An output socket and the groups it was reached through, or an unlinked input."""

    socket: bpy.types.NodeSocket
    groups: tuple
    linked: bool

    @property
    def node(self):
        """The node the socket belongs to."""
        return self.socket.node


def luminance(rgb):
    """Rec. 709 luminance: Blender's conversion of a colour to a number."""
    return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]


def follow(socket, groups=()):
    """Where an input's value comes from, through reroutes, muting and groups."""
    while True:
        link = next((l for l in socket.links if l.is_valid and not l.is_muted), None)
        if link is None:
            return Source(socket, groups, linked=False)
        out, node = link.from_socket, link.from_node
        if node.bl_idname == "NodeReroute":
            socket = node.inputs[0]
        elif node.mute:
            inner = next((l for l in node.internal_links if l.to_socket == out), None)
            if inner is None:
                return Source(out, groups, linked=True)
            socket = inner.from_socket
        elif node.type == "GROUP" and node.node_tree:
            output = next((n for n in node.node_tree.nodes
                           if n.type == "GROUP_OUTPUT" and n.is_active_output), None)
            if output is None:
                return Source(out, groups, linked=True)
            socket = next(s for s in output.inputs if s.identifier == out.identifier)
            groups = groups + (node,)
        elif node.type == "GROUP_INPUT" and groups:
            socket = next(s for s in groups[-1].inputs if s.identifier == out.identifier)
            groups = groups[:-1]
        else:
            return Source(out, groups, linked=True)


def _plain(value):
    """A socket's default as a float or a tuple of three floats."""
    if hasattr(value, "__len__"):
        return tuple(float(c) for c in value)[:3]
    return float(value)


def _describe(node):
    return f'node "{node.name}" ({node.bl_label})'


def evaluate(socket, groups=()):
    """A float, a tuple of three floats, a Texture, or Unknown, in the socket's own type."""
    source = follow(socket, groups)
    if not source.linked:
        if not hasattr(source.socket, "default_value"):
            return Unknown("an empty input")
        value = _plain(source.socket.default_value)
    else:
        value = _output(source)
    return _convert(value, source.socket.type, socket.type)


def _convert(value, from_type, to_type):
    """Blender's implicit conversions between numbers, vectors and colours."""
    if isinstance(value, Unknown):
        return value
    if isinstance(value, Texture):
        if to_type == "VALUE" and value.channel is None:
            return replace(value, channel="luminance")
        if to_type in {"RGBA", "VECTOR"} and value.channel is not None:
            return Unknown(f'one channel of image "{value.image.name}" used as a colour')
        return value
    if to_type == "VALUE" and isinstance(value, tuple):
        return luminance(value) if from_type == "RGBA" else sum(value) / 3.0
    if to_type in {"RGBA", "VECTOR"} and isinstance(value, float):
        return (value, value, value)
    return value


def _input(source, name):
    """Evaluate an input of a source's node by name or index."""
    return evaluate(source.node.inputs[name], source.groups)


def _output(source):
    node = source.node
    if node.type == "VALUE":
        return float(node.outputs[0].default_value)
    if node.type == "RGB":
        return _plain(node.outputs[0].default_value)
    if node.type == "TEX_IMAGE":
        return _image(source)
    if node.type == "MATH":
        return _math(source)
    if node.type == "RGBTOBW":
        value = _input(source, 0)
        if isinstance(value, Texture):
            return replace(value, channel="luminance")
        return value if isinstance(value, Unknown) else luminance(value)
    if node.type in {"SEPRGB", "SEPARATE_COLOR", "SEPXYZ"}:
        if getattr(node, "mode", "RGB") != "RGB":
            return Unknown(f"{_describe(node)} in mode {node.mode}")
        i = list(node.outputs).index(source.socket)
        value = _input(source, 0)
        if isinstance(value, Texture):
            return replace(value, channel="rgb"[i])
        return value if isinstance(value, Unknown) else value[i]
    if node.type in {"COMBRGB", "COMBINE_COLOR", "COMBXYZ"}:
        if getattr(node, "mode", "RGB") != "RGB":
            return Unknown(f"{_describe(node)} in mode {node.mode}")
        parts = tuple(_input(source, i) for i in range(3))
        if all(isinstance(p, float) for p in parts):
            return parts
    return Unknown(_describe(node))


_MATH = {
    "ADD": lambda a, b: a + b,
    "SUBTRACT": lambda a, b: a - b,
    "MULTIPLY": lambda a, b: a * b,
    "DIVIDE": lambda a, b: a / b if b else 0.0,
    "POWER": lambda a, b: a ** b,
    "SQRT": lambda a, b: math.sqrt(a) if a > 0.0 else 0.0,
    "MINIMUM": min,
    "MAXIMUM": max,
    "ABSOLUTE": lambda a, b: abs(a),
}


def _math(source):
    node = source.node
    a, b = _input(source, 0), _input(source, 1)
    if not (isinstance(a, float) and isinstance(b, float) and node.operation in _MATH):
        return Unknown(f"{_describe(node)}, {node.operation.lower()}")
    try:
        value = float(_MATH[node.operation](a, b))
    except (TypeError, ValueError, OverflowError, ZeroDivisionError):
        return Unknown(f"{_describe(node)}, {node.operation.lower()} of {a} and {b}")
    return min(max(value, 0.0), 1.0) if node.use_clamp else value


def _image(source):
    node = source.node
    if node.image is None:
        return Unknown(f"{_describe(node)} without an image")
    for attribute, only in (("projection", "FLAT"), ("extension", "REPEAT")):
        if getattr(node, attribute) != only:
            return Unknown(f"{_describe(node)} with {attribute} {getattr(node, attribute)}")
    space = node.image.colorspace_settings.name
    if space == "sRGB":
        color_space = "srgb"
    elif space in {"Non-Color", "Raw", "Linear", "Linear Rec.709", "Linear BT.709"}:
        color_space = "non_color"
    else:
        return Unknown(f'image "{node.image.name}" in colour space {space}')
    texture = Texture(
        image=node.image,
        color_space=color_space,
        interpolation="closest" if node.interpolation == "Closest" else "bilinear",
        channel="a" if source.socket.name == "Alpha" else None,
    )
    return _place(texture, follow(node.inputs["Vector"], source.groups))


def _place(texture, vector):
    """Read scale and offset off a Mapping node, down to the UVs."""
    if not vector.linked:
        return texture
    node = vector.node
    if node.type == "UVMAP" or (node.type == "TEX_COORD" and vector.socket.name == "UV"):
        return texture  # that it is the mesh's active UV map is checked per object
    if node.type == "MAPPING" and node.vector_type == "POINT":
        location, rotation, scale = (
            evaluate(node.inputs[name], vector.groups)
            for name in ("Location", "Rotation", "Scale"))
        below = follow(node.inputs["Vector"], vector.groups)
        # An empty Vector input of a Mapping node is (0, 0, 0), not the UVs.
        if (all(isinstance(v, tuple) for v in (location, rotation, scale))
                and not any(rotation) and below.linked and below.node.type != "MAPPING"):
            return _place(replace(texture, scale=scale[:2], offset=location[:2]), below)
    return Unknown(f"{_describe(node)} as coordinates of an image")


def uv_map_names(tree):
    """The names of all UV maps that a node tree asks for."""
    names = set()
    for node in tree.nodes:
        if node.type == "UVMAP" or (node.type == "TANGENT" and node.direction_type == "UV_MAP"):
            if node.uv_map:
                names.add(node.uv_map)
        elif node.type == "GROUP" and node.node_tree:
            names |= uv_map_names(node.node_tree)
    return names
