"""Normal Map and Bump nodes to the `normal` and `bump` keys of a material."""

from .nodes import Unknown, describe

STEEP = 20.0  # degrees that the steepest tenth of a map's normals lean by, above which it is told
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
    if source.node.type == "BUMP":
        return _bump(surface, source)
    surface.graph.forget(source.node)
    surface.warn(f"its normal comes from {describe(source.node)}: left out", node)
    return {}


def _bump(surface, source):
    node, groups = source.node, source.groups
    below = keys(surface, node, groups)
    height = surface.value(node, "Height", groups)
    if isinstance(height, float):  # a plain
        surface.idle(node, "Strength", "Distance", "Filter Width")
        surface.graph.view(node).accept("invert")
        return below
    if not isinstance(height, dict):
        surface.warn(f"its height comes from {height.what}: left out", node)
        return below
    if "bump" in below:
        surface.warn("its own normal comes from another bump: that one is left out", node)
        del below["bump"]
    bump = dict(height)
    rise = surface.writer.slope(height["texture"])
    for name, usual in (("Strength", 1.0), ("Distance", 1.0)):
        value = surface.scalar(node, name, groups, 0.0)
        if value != usual:
            bump[name.lower()] = value
        rise *= value if isinstance(value, float) else 1.0
    surface.writer.steepness[surface.name] = max(rise, surface.writer.steepness[surface.name])
    if surface.graph.view(node).invert:
        bump["invert"] = True
    # Until 4.3 Cycles compared heights a whole pixel apart.
    width = surface.scalar(node, "Filter Width", groups, 1e-3, 16.0) if "Filter Width" in node.inputs else 1.0
    if not isinstance(width, float):
        surface.warn("its filter width comes from a texture: 0.1 is written", node)
    elif abs(width - 0.1) > 1e-6:
        bump["filter_width"] = width
    surface.writer.perturbed.add(surface.name)
    return {**below, "bump": bump}


def _normal_map(surface, source):
    node = source.node
    view = surface.graph.view(node)
    space = _SPACES.get(view.space)
    color = surface.value(node, "Color", source.groups)
    if color == (0.5, 0.5, 1.0) and space == "tangent":
        return {}  # the unchanged normal
    if space is None or not isinstance(color, dict):
        what = color.what if isinstance(color, Unknown) else \
            "a constant" if isinstance(color, tuple) else f"the space {view.space.lower()}"
        surface.warn(f"its normals come from {what}: left out", node)
        return {}
    texture = surface.writer.textures.get(color["texture"], {})
    own = surface.writer.is_own(view.uv_map or None)
    if space == "tangent" and texture.get("uv_map") != (None if own else view.uv_map):
        surface.warn("its tangents are those of another UV map than its image's: the image's are taken", node)
    normal = {"texture": color["texture"]}
    strength = surface.scalar(node, "Strength", source.groups, 0.0)
    tilt = surface.writer.tilt(color["texture"]) if space == "tangent" else 0.0
    if isinstance(strength, float) and tilt * min(strength, 1.0) > STEEP:
        surface.warn(f"its normals lean by {tilt:.0f}° and more: light that Cycles loses there is kept, and goes "
                     "elsewhere", node)
    if strength != 1.0:
        normal["strength"] = strength
    if space != "tangent":
        normal["space"] = space
    surface.writer.perturbed.add(surface.name)
    return {"normal": normal}
