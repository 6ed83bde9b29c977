"""The Principled BSDF node."""

import bpy

from . import relief

# Which of Cycles' models of the node this Blender has.
VERSION = 3.4 if bpy.app.version < (4, 0, 0) else 4.5 if bpy.app.version < (5, 0, 0) else 5.0

# Sockets of the Principled node that the format has keys for: the key is the
# name in lower case with underscores. (default, least, most) for numbers.
_NUMBERS = {
    3.4: {"subsurface": (0.0, 0.0, 1.0), "metallic": (0.0, 0.0, 1.0), "specular": (0.5, 0.0, None),
          "specular_tint": (0.0, 0.0, 1.0), "roughness": (0.5, 0.0, 1.0), "anisotropic": (0.0, 0.0, 1.0),
          "sheen": (0.0, 0.0, 1.0), "sheen_tint": (0.5, 0.0, 1.0), "clearcoat": (0.0, 0.0, 1.0),
          "clearcoat_roughness": (0.03, 0.0, 1.0), "ior": (1.45, 1e-3, None), "transmission": (0.0, 0.0, 1.0),
          "transmission_roughness": (0.0, 0.0, 1.0), "emission_strength": (1.0, 0.0, None),
          "alpha": (1.0, 0.0, 1.0)},
    4.5: {"metallic": (0.0, 0.0, 1.0), "roughness": (0.5, 0.0, 1.0), "ior": (1.5, 1e-3, None),
          "alpha": (1.0, 0.0, 1.0), "diffuse_roughness": (0.0, 0.0, 1.0), "subsurface_weight": (0.0, 0.0, 1.0),
          "specular_ior_level": (0.5, 0.0, None), "anisotropic": (0.0, 0.0, 1.0),
          "transmission_weight": (0.0, 0.0, 1.0), "coat_weight": (0.0, 0.0, 1.0),
          "coat_roughness": (0.03, 0.0, 1.0), "coat_ior": (1.5, 1.0, None), "sheen_weight": (0.0, 0.0, 1.0),
          "sheen_roughness": (0.5, 0.0, 1.0), "emission_strength": (0.0, 0.0, None),
          "thin_film_thickness": (0.0, 0.0, None), "thin_film_ior": (1.33, 1e-5, None)},
}
_COLORS = {
    3.4: {"base_color": 0.8, "subsurface_color": 0.8, "emission": 0.0},
    4.5: {"base_color": 0.8, "specular_tint": 1.0, "coat_tint": 1.0, "sheen_tint": 1.0, "emission_color": 1.0},
}
for _table in (_NUMBERS, _COLORS):
    _table[5.0] = _table[4.5]
# Inputs that say nothing while the input they shape is 0.
_IDLE = {
    "Subsurface": ("Subsurface Radius", "Subsurface IOR", "Subsurface Anisotropy", "Subsurface Color"),
    "Subsurface Weight": ("Subsurface Radius", "Subsurface Scale", "Subsurface IOR", "Subsurface Anisotropy"),
    "Anisotropic": ("Anisotropic Rotation", "Tangent"),
    "Clearcoat": ("Clearcoat Normal", "Clearcoat Roughness"),
    "Coat Weight": ("Coat Normal", "Coat Roughness", "Coat IOR", "Coat Tint"),
    "Thin Film Thickness": ("Thin Film IOR",),
}
_UNITLESS = {"emission", "emission_color"}  # colours that may pass 1


def translate(surface, node, groups):
    """Principled BSDF: the node's sockets, by the rules of this Blender's Cycles."""
    keys = {"version": VERSION, "layering": "cycles"}
    choice = surface.graph.view(node).distribution
    if choice.lower() != ("ggx" if VERSION == 3.4 else "multi_ggx"):
        keys["distribution"] = choice.lower()
    surface.graph.view(node).accept("subsurface_method")
    for socket in node.inputs:
        if not socket.enabled:
            continue
        key = socket.name.lower().replace(" ", "_")
        if key in _NUMBERS[VERSION]:
            default, low, high = _NUMBERS[VERSION][key]
            value = surface.scalar(node, socket.name, groups, low, high)
        elif key in _COLORS[VERSION]:
            default = _COLORS[VERSION][key]
            value = surface.color(node, socket.name, groups, unit=key not in _UNITLESS)
        else:
            continue
        if value == 0.0 and isinstance(value, float):
            surface.idle(node, *_IDLE.get(socket.name, ()))
        if not (isinstance(value, float) and abs(value - default) < 1e-7):
            keys[key] = value
    if "Thin Film Thickness" in node.inputs and not node.inputs["Thin Film Thickness"].is_linked \
            and node.inputs["Thin Film Thickness"].default_value == 0.0:
        surface.idle(node, *_IDLE["Thin Film Thickness"])
    if keys.get("thin_film_thickness") and (keys.get("metallic") or keys.get("transmission_weight")):
        surface.warn("its thin film on metal or glass is summed over 32 wavelengths, and on metal lies over the "
                     "complex index that reflects as the node does bare, where Cycles takes another: colours differ "
                     "by some percent", node)
    if keys.get("anisotropic"):
        surface.tell_scaling(node)
        rotation = surface.turns(node, "Anisotropic Rotation", groups)
        if rotation != 0.0:
            keys["anisotropic_rotation"] = rotation
        keys.update(surface.tangent(node, groups))
    if any(keys.get(k) for k in ("subsurface", "subsurface_weight")):
        surface.warn("subsurface light comes out where it went in", node)
        surface.idle(node, *_IDLE["Subsurface"], *_IDLE["Subsurface Weight"])
    keys.update(relief.keys(surface, node, groups))
    keys.setdefault("base_color", 0.8)
    return {"principled": keys}
