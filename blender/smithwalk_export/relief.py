"""Normal Map nodes to the `normal` key of a material."""

from .nodes import Unknown, describe

_SPACES = {"TANGENT": "tangent", "OBJECT": "object", "WORLD": "world"}


def keys(surface, node, groups, name="Normal"):
    """The keys that say what feeds a normal input."""
    if name not in node.inputs:
        return {}
    source = surface.graph.follow(node.inputs[name], groups)
    if not source.linked or source.node.mute:
        return {}
    if source.node.type == "NORMAL_MAP":
        return _normal_map(surface, source)
    surface.graph.forget(source.node)
    surface.warn(f"its normal comes from {describe(source.node)}: left out", node)
    return {}


def _normal_map(surface, source):
    node = source.node
    view = surface.graph.view(node)
    view.accept("uv_map")
    space = _SPACES.get(view.space)
    color = surface.value(node, "Color", source.groups)
    if color == (0.5, 0.5, 1.0) and space == "tangent":
        return {}  # the unchanged normal
    if space is None or not isinstance(color, dict):
        what = color.what if isinstance(color, Unknown) else \
            "a constant" if isinstance(color, tuple) else f"the space {view.space.lower()}"
        surface.warn(f"its normals come from {what}: left out", node)
        return {}
    normal = {"texture": color["texture"]}
    strength = surface.scalar(node, "Strength", source.groups, 0.0)
    if strength != 1.0:
        normal["strength"] = strength
    if space != "tangent":
        normal["space"] = space
    return {"normal": normal}
