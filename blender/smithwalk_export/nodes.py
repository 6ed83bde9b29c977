"""What feeds a socket: a constant, an image texture, or something else.

Links are followed through reroutes, muted nodes and node groups. Chains of
converter nodes on constants are folded (`fold.py`). All that is read of a
node is recorded, so that the rest can be named (`audit.py`).
"""

from dataclasses import dataclass, replace

import bpy
from mathutils import Euler, Matrix

from . import fold
from .fold import NotConstant, luminance

LINEAR_SPACES = {"Non-Color", "Raw", "Linear", "Linear Rec.709", "Linear BT.709", "scene_linear"}
_REC709 = "Linear Rec.709"


def working_space():
    """The space of scene-linear colours: a choice from Blender 5.0 on."""
    colorspace = getattr(bpy.data, "colorspace", None)
    return getattr(colorspace, "working_space", _REC709)


def color_space(image):
    """How the renderer is to read an image's values: srgb or non_color; linear where they are
    converted as they are written, for the renderer knows no other spaces."""
    name, working = image.colorspace_settings.name, working_space()
    if name in {"Non-Color", "Raw", "scene_linear", working} or (working == _REC709 and name in LINEAR_SPACES):
        return "non_color"
    return "srgb" if name == "sRGB" and working == _REC709 else "linear"


@dataclass(frozen=True)
class Texture:
    """An image lookup, or colours of vertices. `channel` is None for the colour, else r, g, b, a
    or luminance."""

    image: bpy.types.Image = None
    colors: str = None  # the name of a colour attribute, without an image
    uv_map: str = None  # the name of a UV map, where a node gives one
    color_space: str = "srgb"
    interpolation: str = "bilinear"
    extension: str = "repeat"
    matrix: tuple = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))  # from UVs to the image
    channel: str = None
    alpha: str = None  # where it is one: whether it is "asked" for beside the colour, or "unasked"


@dataclass(frozen=True)
class Unknown:
    """Something that only Cycles can evaluate; `what` names it."""

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


def _plain(value):
    """A socket's default as a float or a tuple of three floats."""
    if hasattr(value, "__len__"):
        return tuple(float(c) for c in value)[:3]
    return float(value)


def describe(node):
    """A node for a message: its name, and its kind where the name does not say it."""
    label = node.bl_label
    return f'node "{node.name}"' if node.name.startswith(label) else f'node "{node.name}" ({label})'


def link_into(socket):
    """The link that feeds an input, or None."""
    return next((l for l in socket.links if l.is_valid and not l.is_muted), None)


def step(socket, groups):
    """One step up from an input: (socket, groups, arrived), the socket an output when
    arrived at a node, an input when the search goes on, None where nothing feeds it."""
    link = link_into(socket)
    if link is None:
        return socket, groups, None
    out, node = link.from_socket, link.from_node
    if node.bl_idname == "NodeReroute":
        return node.inputs[0], groups, False
    if node.mute:
        inner = next((l for l in node.internal_links if l.to_socket == out), None)
        return (inner.from_socket, groups, False) if inner else (out, groups, True)
    if node.type == "GROUP" and node.node_tree:
        output = next((n for n in node.node_tree.nodes
                       if n.type == "GROUP_OUTPUT" and n.is_active_output), None)
        inside = output and next((s for s in output.inputs if s.identifier == out.identifier), None)
        return (inside, groups + (node,), False) if inside else (out, groups, None)
    if node.type == "GROUP":  # its tree is missing
        return out, groups, None
    if node.type == "GROUP_INPUT" and groups:
        outside = next((s for s in groups[-1].inputs if s.identifier == out.identifier), None)
        return (outside, groups[:-1], False) if outside else (out, groups, True)
    return out, groups, True


class Graph:
    """The node trees of one material, light or world, and what was read of them."""

    def __init__(self, audit):
        self.audit = audit
        self._inputs = {}   # node pointer → identifiers of the inputs read
        self._nodes = {}    # node pointer → node
        self.head_on = False  # take what depends on the view as seen head on, by the camera

    def view(self, node):
        """The node with its property reads recorded."""
        self._nodes[node.as_pointer()] = node
        return self.audit.view(node)

    def lost(self):
        """For each node that was read in part: (node, what was not read though it matters)."""
        for key, node in self._nodes.items():
            for what in self.audit.node_leftovers(node, self._inputs.get(key, set())):
                yield node, what

    def forget(self, node):
        """Nothing of this node needs naming: it was named, or evaluated, as a whole."""
        self._nodes.pop(node.as_pointer(), None)

    def follow(self, socket, groups=()):
        """Where an input's value comes from, through reroutes, muting and groups."""
        self._inputs.setdefault(socket.node.as_pointer(), set()).add(socket.identifier)
        arrived = False
        while arrived is False:
            socket, groups, arrived = step(socket, groups)
        return Source(socket, groups, linked=arrived is True)

    def evaluate(self, socket, groups=()):
        """A float, a tuple of three floats, a Texture, or Unknown, in the socket's own type."""
        source = self.follow(socket, groups)
        if not source.linked:
            if not hasattr(source.socket, "default_value"):
                return Unknown("an empty input")
            value = _plain(source.socket.default_value)
        elif source.node.mute:
            value = (0.0, 0.0, 0.0) if source.socket.type != "VALUE" else 0.0
        else:
            value = self._output(source)
        return _convert(value, source.socket.type, socket.type)

    def read(self, source, name):
        """An input of a source's node, by name or index."""
        inputs = source.node.inputs
        if name == "Fac" and name not in inputs:
            name = "Factor"
        return self.evaluate(inputs[name], source.groups)

    def _output(self, source):
        node = source.node
        view = self.view(node)

        def unknown(what=None):
            self.forget(node)
            return Unknown(what or describe(node))

        if node.type in {"VALUE", "RGB"}:
            return _plain(node.outputs[0].default_value)
        if node.type == "TEX_IMAGE":
            value = self._image(source, view)
            return unknown(value.what) if isinstance(value, Unknown) else value
        if node.type in {"SEPRGB", "SEPARATE_COLOR", "SEPXYZ"}:
            value = self._separate(source, view)
            return unknown() if value is None else value
        if node.type in {"VERTEX_COLOR", "ATTRIBUTE"} and source.socket.name == "Color":
            name = _colors(view)
            return Texture(colors=name, color_space="linear") if name else unknown()
        if node.type == "RGBTOBW":
            value = self.read(source, 0)
            if isinstance(value, Texture):
                return replace(value, channel="luminance")
            return luminance(value) if isinstance(value, tuple) else unknown()

        if self.head_on and node.type in _VIEW | {"NEW_GEOMETRY"}:
            value = self._seen_head_on(source)
            return unknown() if value is None else value

        def constant(name):
            value = self.read(source, name)
            if isinstance(value, (Texture, Unknown)):
                raise NotConstant
            return value

        try:
            value = fold.converter(view, constant)
        except NotConstant:
            return unknown()
        return unknown() if value is None else value

    def _seen_head_on(self, source):
        """A view-dependent output for a camera ray along the normal, from outside."""
        kind, name = source.node.type, source.socket.name
        self.forget(source.node)
        if kind == "LIGHT_PATH":
            return 1.0 if name == "Is Camera Ray" else 0.0
        if kind == "NEW_GEOMETRY":
            return 0.0 if name == "Backfacing" else None
        if kind in {"FRESNEL", "LAYER_WEIGHT"}:
            value = self.read(source, 0)
            if not isinstance(value, float):
                return None
            if name == "Facing":
                return 0.0
            ior = value if kind == "FRESNEL" else 1.0 / max(1.0 - value, 1e-5)
            return ((ior - 1.0) / (ior + 1.0)) ** 2
        return None

    def _separate(self, source, view):
        mode = view.get("mode", "RGB")
        i = list(source.node.outputs).index(source.socket)
        value = self.read(source, 0)
        if isinstance(value, Texture):
            return replace(value, channel="rgb"[i]) if mode == "RGB" and value.channel is None else None
        if isinstance(value, Unknown):
            return None
        if mode == "HSV":
            return fold.rgb_to_hsv(value)[i]
        return value[i] if mode == "RGB" else None

    def _image(self, source, view):
        node = source.node
        image = view.image
        view.accept("image_user")  # frames of sequences are checked where the image is written
        if image is None:
            return (1.0, 0.0, 1.0)  # Cycles' colour of a missing image
        if view.projection != "FLAT":
            return Unknown(f"{describe(node)} with projection {node.projection.lower()}")
        view.accept("projection_blend")
        if image.source in {"SEQUENCE", "MOVIE"}:
            return Unknown(f'image "{image.name}", a {image.source.lower()} one')
        space = image.colorspace_settings.name
        if image.source == "TILED" and color_space(image) == "linear":
            return Unknown(f'image "{image.name}" of tiles in colour space {space}')
        asks_alpha = any(l.is_valid for l in node.outputs["Alpha"].links)
        associated = image.alpha_mode in {"STRAIGHT", "PREMUL"} and space not in {"Non-Color", "Raw"}
        if source.socket.name == "Alpha" and image.alpha_mode == "NONE":
            return 1.0
        texture = Texture(
            image=image,
            color_space=color_space(image),
            interpolation={"Closest": "closest", "Linear": "bilinear"}.get(view.interpolation, "cubic"),
            extension=view.extension.lower(),
            channel="a" if source.socket.name == "Alpha" else None,
            alpha=("asked" if asks_alpha else "unasked") if associated else None,
        )
        return self._place(texture, self.follow(node.inputs["Vector"], source.groups))

    def _place(self, texture, vector, placed=Matrix()):
        """Read how Mapping nodes place an image, down to the UVs; `placed` is what comes after."""
        if not vector.linked:
            return _placed(texture, placed)
        node = vector.node
        view = self.view(node)
        if node.type == "UVMAP" or (node.type == "TEX_COORD" and vector.socket.name == "UV"):
            name = view.get("uv_map") or None
            if not view.get("from_instancer"):
                return _placed(replace(texture, uv_map=name), placed)
        elif node.type == "MAPPING" and view.vector_type != "NORMAL":
            location, rotation, scale = (
                self.evaluate(node.inputs[name], vector.groups) if node.inputs[name].enabled else (0.0, 0.0, 0.0)
                for name in ("Location", "Rotation", "Scale"))
            below = self.follow(node.inputs["Vector"], vector.groups)
            # An empty Vector input of a Mapping node is (0, 0, 0), not the UVs.
            if all(isinstance(v, tuple) for v in (location, rotation, scale)) and below.linked:
                step = _mapping(view.vector_type, location, rotation, scale)
                return self._place(texture, below, placed @ step)
        self.forget(node)
        return Unknown(f"{describe(node)} as coordinates of an image")


def _colors(view):
    """The name of the colour attribute that a node reads, or None."""
    if view.get("layer_name"):
        return view.layer_name
    name = view.get("attribute_name")
    if not name or view.attribute_type != "GEOMETRY":
        return None
    # An attribute node may name anything: the meshes know whether that is colours.
    colors = any(name in mesh.color_attributes for mesh in bpy.data.meshes)
    return name if colors and not any(name in mesh.uv_layers for mesh in bpy.data.meshes) else None


def _mapping(kind, location, rotation, scale):
    """What a Mapping node of constants does to a vector."""
    turn = Euler(rotation).to_matrix().to_4x4()
    if kind == "TEXTURE":
        shrink = Matrix.Diagonal([fold.safe_divide(1.0, s) for s in scale]).to_4x4()
        return shrink @ turn.transposed() @ Matrix.Translation([-c for c in location])
    move = Matrix.Translation(location if kind == "POINT" else (0.0, 0.0, 0.0))
    return move @ turn @ Matrix.Diagonal(scale).to_4x4()


def _placed(texture, matrix):
    rows = tuple((matrix[i][0], matrix[i][1], matrix[i][3]) for i in range(2))
    if rows[0][0] * rows[1][1] == rows[0][1] * rows[1][0]:
        return Unknown(f'image "{texture.image.name}", flattened')
    return replace(texture, matrix=rows)


def _convert(value, from_type, to_type):
    """Blender's implicit conversions between numbers, vectors and colours."""
    if isinstance(value, Unknown):
        return value
    if isinstance(value, Texture):
        if to_type == "VALUE" and value.channel is None:
            return replace(value, channel="luminance")
        if to_type in {"RGBA", "VECTOR"} and value.channel is not None:
            what = f'image "{value.image.name}"' if value.image else f'colours "{value.colors}"'
            return Unknown(f"one channel of {what} used as a colour")
        return value
    if to_type == "VALUE" and isinstance(value, tuple):
        return luminance(value) if from_type == "RGBA" else sum(value) / 3.0
    if to_type in {"RGBA", "VECTOR"} and isinstance(value, float):
        return (value, value, value)
    return value


# What a value depends on, found by walking up all its inputs

_INSTANCE = {"OBJECT_INFO", "PARTICLE_INFO", "HAIR_INFO", "CURVES_INFO", "POINT_INFO", "TEX_POINTDENSITY"}
_VIEW = {"FRESNEL", "LAYER_WEIGHT", "CAMERA", "LIGHT_PATH", "AMBIENT_OCCLUSION", "BEVEL", "SHADERTORGB",
         "RAYCAST"}
_SURFACE_IF_UNLINKED = "TEX_"


def dependencies(socket, groups=()):
    """What feeds a socket depends on: a set of uv, mapped, surface, instance, view.

    `mapped` says that UVs are moved or procedurals read them, so that values
    need not repeat with the unit square.
    """
    found, seen, todo = set(), set(), [(socket, groups)]
    while todo:
        socket, groups = todo.pop()
        arrived = False
        while arrived is False:
            socket, groups, arrived = step(socket, groups)
        if arrived is None:
            continue
        node, key = socket.node, (socket.as_pointer(), tuple(g.as_pointer() for g in groups))
        if key in seen:
            continue
        seen.add(key)
        found |= _own_dependencies(node, socket)
        todo += [(s, groups) for s in node.inputs if s.enabled]
    return found


def _own_dependencies(node, socket):
    if node.type in _VIEW:
        return {"view"}
    if node.type in _INSTANCE:
        return {"instance"}
    if node.type == "TEX_COORD":
        if socket.name in {"Camera", "Window", "Reflection"}:
            return {"view"}
        if socket.name == "UV":
            return {"uv"}
        return {"surface", "instance"} if node.object or node.from_instancer else {"surface"}
    if node.type == "NEW_GEOMETRY":
        return {"view"} if socket.name in {"Incoming", "Backfacing"} else {"surface", "instance"}
    if node.type == "UVMAP":
        return {"uv"}
    if node.type in {"ATTRIBUTE", "VERTEX_COLOR", "TANGENT", "WIREFRAME", "UVALONGSTROKE", "NORMAL_MAP",
                     "BUMP", "SCRIPT", "VOLUME_INFO"}:
        return {"surface", "instance"} if getattr(node, "attribute_type", "GEOMETRY") != "GEOMETRY" else {"surface"}
    if node.type == "TEX_IMAGE":
        if node.projection != "FLAT":
            return {"surface"}
        repeats = node.extension == "REPEAT" and not node.inputs["Vector"].is_linked
        return set() if node.inputs["Vector"].is_linked else ({"uv"} if repeats else {"uv", "mapped"})
    if node.type.startswith(_SURFACE_IF_UNLINKED):
        vector = node.inputs.get("Vector")
        linked = vector is not None and vector.is_linked
        return {"mapped"} if linked else {"surface"}
    if node.type in {"MAPPING", "VECT_MATH", "VECTOR_ROTATE", "CURVE_VEC", "COMBXYZ", "SEPXYZ"}:
        return {"mapped"}
    return set()


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
