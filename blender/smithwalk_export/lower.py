"""Materials in the words that the renderer has today.

The exporter writes Blender's nodes as they are (`principled`, `sum`, …); what
the renderer does not read yet is replaced here by what is nearest, and named.
"""

_OPAQUE_TO = {"translucent": "diffuse", "velvet": "diffuse", "sheen": "diffuse"}


def lower(material, tell):
    """The same material without the newer kinds; `tell(what)` names each loss."""
    (kind, keys), = material.items()
    if kind == "mix":
        factor = keys["factor"]
        if isinstance(factor, dict) and "texture" not in factor or isinstance(factor, str):
            factor, what = _factor(factor)
            tell(f"a mix by {what} is written with the factor {factor:.3g}")
        return {"mix": {"factor": factor, "a": lower(keys["a"], tell), "b": lower(keys["b"], tell)}}
    if kind == "sum":
        tell("a sum of shaders: only the first is kept")
        return lower(keys["a"], tell)
    if kind == "refraction":
        tell("refraction alone is written as glass, which also reflects")
        return {"dielectric": _constant(keys, "ior", 1.5, tell)}
    if kind in _OPAQUE_TO:
        tell(f"{kind} is written as diffuse")
        return {"diffuse": {"color": keys["color"]}}
    if kind == "diffuse" and "roughness" in keys:
        tell("Roughness (Oren-Nayar) is written as Lambert")
        return {"diffuse": {"color": keys["color"]}}
    if kind == "dielectric":
        return {"dielectric": _constant(keys, "ior", 1.5, tell)}
    if kind == "emission":
        return {"emission": _constant(keys, "strength", 1.0, tell)}
    if kind == "transparent" and isinstance(keys.get("color"), dict):
        tell("a textured transparent colour is left out: written as white")
        return {"transparent": {}}
    if kind == "conductor":
        return {"conductor": _edge(keys, tell)}
    if kind == "principled":
        return _principled(keys, tell)
    return material


def _constant(keys, name, used, tell):
    if not isinstance(keys.get(name), (dict, list)):
        return keys
    tell(f"{name} can't be textured: {used:g} is written")
    return {**keys, name: used}


def _edge(keys, tell):
    if "edge_tint" not in keys:
        return keys
    keys = dict(keys)
    tint, f0 = keys.pop("edge_tint"), keys["f0"]
    if isinstance(f0, dict) or isinstance(tint, dict):
        tell("a textured base colour or tint leaves out the edge tint")
        return keys
    f0 = f0 if isinstance(f0, list) else [f0] * 3
    tint = tint if isinstance(tint, list) else [tint] * 3
    keys["f82"] = [(f + (1.0 - f) * (6.0 / 7.0) ** 5) * t for f, t in zip(f0, tint)]
    return keys


def _factor(factor):
    if factor == "backfacing":
        return 0.0, "backfacing"
    if factor == "camera_ray":
        return 0.0, "camera rays"
    (kind, keys), = factor.items()
    value = next(iter(keys.values()))
    if kind == "fresnel":
        ior = value if isinstance(value, float) else 1.45
        return ((ior - 1.0) / (ior + 1.0)) ** 2, "the Fresnel reflectance"
    return 0.2, "the angle to the view"


def _mix(factor, a, b):
    if factor == 0.0:
        return a
    if factor == 1.0:
        return b
    return {"mix": {"factor": factor, "a": a, "b": b}}


def _principled(keys, tell):
    new = keys["version"] > 4.0
    base, metallic = keys["base_color"], keys.get("metallic", 0.0)
    transmission = keys.get("transmission_weight" if new else "transmission", 0.0)
    for name in ("subsurface", "subsurface_weight", "clearcoat", "coat_weight", "sheen", "sheen_weight",
                 "diffuse_roughness"):
        if keys.get(name, 0.0) != 0.0:
            tell(f"{name.replace('_', ' ')} is left out")
    rough = {} if keys.get("distribution", "multi_ggx" if new else "ggx") == "multi_ggx" \
        else {"scattering": "single"}
    roughness, anisotropic = keys.get("roughness", 0.5), keys.get("anisotropic", 0.0)
    if anisotropic == 0.0:
        rough["roughness"] = roughness
    elif isinstance(roughness, dict) or isinstance(anisotropic, dict):
        tell("anisotropic with a texture on it or on roughness is left out")
        rough["roughness"] = roughness
    else:
        aspect = (1.0 - 0.9 * anisotropic) ** 0.5
        rough.update(alpha_x=min(roughness ** 2 / aspect, 1.0), alpha_y=roughness ** 2 * aspect)
        if keys.get("anisotropic_rotation"):
            rough["rotation"] = keys["anisotropic_rotation"]
        if "tangent" in keys:
            rough["tangent"] = keys["tangent"]
    surface = None
    if metallic != 1.0:
        if transmission != 1.0:
            tell("the specular layer over the diffuse base is left out: Lambert")
        ior = keys.get("ior", 1.5 if new else 1.45)
        if isinstance(ior, dict):
            tell("ior can't be textured: 1.45 is written")
            ior = 1.45
        if transmission != 0.0 and base != 1.0:
            tell("the colour of glass is not Cycles'")
        surface = _mix(transmission, {"diffuse": {"color": base}},
                       {"dielectric": {**rough, "ior": ior, "color": base}})
    if metallic != 0.0:
        metal = {"conductor": _edge({**rough, "f0": base,
                                     **({"edge_tint": keys["specular_tint"]} if new and "specular_tint" in keys
                                        else {})}, tell)}
        surface = _mix(metallic, surface, metal)
    strength = keys.get("emission_strength", 0.0 if new else 1.0)
    glow = keys.get("emission_color" if new else "emission", 1.0 if new else 0.0)
    if strength != 0.0 and glow != 0.0:
        if base == 0.0 or base == [0.0, 0.0, 0.0]:
            surface = lower({"emission": {"color": glow, "strength": strength}}, tell)
        else:
            tell("emission on top of a surface is left out")
    return _mix(keys.get("alpha", 1.0), {"transparent": {}}, surface)
