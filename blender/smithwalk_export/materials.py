"""Shader nodes to the materials of the scene format.

One function per node type returns a material as the format writes it, e.g.
`{"conductor": {"roughness": 0.5}}`. What has no counterpart is named in the
log; a surface that can't be carried at all becomes the magenta placeholder.
"""

from . import nodes
from .meshes import unique_name
from .nodes import Texture, Unknown, evaluate, follow

PLACEHOLDER = {"diffuse": {"color": [1.0, 0.0, 1.0]}}
BLACK = {"diffuse": {"color": 0.0}}


def _grey(rgb):
    """A colour as one number if it is grey, else as a list."""
    return rgb[0] if rgb[0] == rgb[1] == rgb[2] else list(rgb)


class MaterialWriter:
    """Translates each Blender material once; owns the scene's textures."""

    def __init__(self, images, log):
        self.images = images
        self.log = log
        self.materials = {}     # name in the scene → material
        self.textures = {}      # name in the scene → texture
        self.radial_axes = {}   # name in the scene → set of axes its tangents turn about
        self.uv_maps = {}       # name in the scene → set of UV map names it asks for
        self._names = {}        # Blender's name_full (or None) → name in the scene
        self._textures = {}     # (Texture without channel) → name in the scene

    def add(self, material):
        """The name in the scene of a Blender material (None: Cycles' default surface)."""
        key = material.name_full if material else None
        if key not in self._names:
            name = unique_name(material.name if material else "default", self.materials)
            self._names[key] = name
            self.radial_axes[name] = set()
            self.uv_maps[name] = set()
            self.materials[name] = None  # reserves the name
            self.materials[name] = _Surface(self, material, name).translate()
        return self._names[key]

    def texture(self, texture, where):
        """The name in the scene of a texture, or None when its image has no pixels."""
        key = (texture.image.name_full, texture.color_space, texture.interpolation,
               texture.scale, texture.offset)
        if key not in self._textures:
            file = self.images.add(texture.image, where)
            name = None
            if file:
                name = unique_name(file.rsplit(".", 1)[0], self.textures)
                entry = {"file": file, "color_space": texture.color_space}
                if texture.interpolation != "bilinear":
                    entry["interpolation"] = texture.interpolation
                if texture.scale != (1.0, 1.0):
                    entry["scale"] = list(texture.scale)
                if texture.offset != (0.0, 0.0):
                    entry["offset"] = list(texture.offset)
                self.textures[name] = entry
            self._textures[key] = name
        return self._textures[key]


class _Surface:
    """The translation of one material's node tree."""

    def __init__(self, writer, material, name):
        self.writer = writer
        self.material = material
        self.name = name

    def warn(self, what, node=None):
        """Name a loss of this material."""
        where = f'material "{self.material.name}"'
        if node is not None:
            where += f', node "{node.name}"'
        self.writer.log.warn(where, what)

    def translate(self):
        """The whole material."""
        material = self.material
        if material is None:
            return {"diffuse": {"color": 0.8}}
        if not material.use_nodes or material.node_tree is None:
            return {"diffuse": {"color": _grey(tuple(material.diffuse_color)[:3])}}
        output = material.node_tree.get_output_node("CYCLES")
        if output is None or not output.inputs["Surface"].is_linked:
            self.warn("has no surface: written as black")
            return BLACK
        for name in ("Volume", "Displacement"):
            if output.inputs[name].is_linked:
                self.warn(f"{name.lower()} is left out")
        self.writer.uv_maps[self.name] = nodes.uv_map_names(material.node_tree)
        return self.closure(output.inputs["Surface"], ())

    def closure(self, socket, groups):
        """The material that feeds a shader socket."""
        source = follow(socket, groups)
        if not source.linked:
            return BLACK  # an empty shader socket neither reflects nor emits
        translate = _CLOSURES.get(source.node.type)
        if translate is None:
            self.warn(f"{source.node.bl_label} has no counterpart: magenta placeholder", source.node)
            return PLACEHOLDER
        normal = source.node.inputs.get("Normal")
        if normal is not None and normal.is_linked:
            self.warn("normal input (bump or normal map) is left out", source.node)
        return translate(self, source.node, source.groups)

    # Values

    def scalar(self, node, name, groups, low=None, high=None):
        """A number input: a float, or `{texture, channel}`."""
        value = evaluate(node.inputs[name], groups)
        if isinstance(value, Texture):
            texture = self.writer.texture(value, f'material "{self.material.name}"')
            if texture:
                entry = {"texture": texture}
                if value.channel != "luminance":
                    entry["channel"] = value.channel
                return entry
            value = Unknown(f'image "{value.image.name}"')
        label = node.inputs[name].name
        if isinstance(value, Unknown):
            used = float(node.inputs[name].default_value)
            self.warn(f"{label} comes from {value.what}: replaced by {used:g}", node)
            value = used
        clamped = value if low is None else min(max(value, low), high)
        if clamped != value:
            self.warn(f"{label} {value:g} is clamped to {clamped:g}", node)
        return clamped

    def constant(self, node, name, groups, low=None, high=None):
        """A number input that the format allows no texture on."""
        value = self.scalar(node, name, groups, low, high)
        if isinstance(value, dict):
            used = float(node.inputs[name].default_value)
            self.warn(f"{name} can't be textured: replaced by {used:g}", node)
            return used
        return value

    def color(self, node, name, groups, unit=True):
        """A colour input: a number, a list, or `{texture}`; magenta if it can't be carried."""
        value = evaluate(node.inputs[name], groups)
        if isinstance(value, Texture):
            texture = self.writer.texture(value, f'material "{self.material.name}"')
            if texture:
                return {"texture": texture}
            value = Unknown(f'image "{value.image.name}"')
        if isinstance(value, Unknown):
            self.warn(f"{name} comes from {value.what}: magenta placeholder", node)
            return [1.0, 0.0, 1.0]
        clamped = tuple(min(max(c, 0.0), 1.0) for c in value) if unit else value
        if clamped != value:
            self.warn(f"{name} {value} is clamped to 0…1", node)
        return _grey(clamped)

    def distribution(self, node):
        """The format's distribution and scattering keys for a node's menu, and whether α = 0."""
        choice = node.distribution
        if choice == "MULTI_GGX":
            return {}, False
        if choice == "ASHIKHMIN_SHIRLEY":
            self.warn("Ashikhmin-Shirley is written as single-scattering GGX", node)
        if choice == "SHARP":
            return {}, True
        keys = {"distribution": "beckmann"} if choice == "BECKMANN" else {}
        return {**keys, "scattering": "single"}, False

    def tangent(self, node, groups):
        """The `tangent` key of an anisotropic node."""
        source = follow(node.inputs["Tangent"], groups)
        if source.linked and source.node.type == "TANGENT":
            if source.node.direction_type == "UV_MAP":
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
        if sharp:
            return {"alpha": 0.0}
        keys["roughness"] = self.scalar(node, "Roughness", groups, 0.0, 1.0)
        if "Anisotropy" in node.inputs:
            anisotropy = self.scalar(node, "Anisotropy", groups, -1.0, 1.0)
            if anisotropy != 0.0:
                keys["anisotropy"] = anisotropy
                rotation = self.scalar(node, "Rotation", groups)
                if rotation != 0.0:
                    keys["rotation"] = rotation
                keys.update(self.tangent(node, groups))
        return keys

    # Closures

    def diffuse(self, node, groups):
        """Diffuse BSDF: Lambert. Its Roughness is Oren-Nayar's, which is another model."""
        if self.scalar(node, "Roughness", groups) != 0.0:
            self.warn("Roughness (Oren-Nayar) is left out: written as Lambert", node)
        return {"diffuse": {"color": self.color(node, "Color", groups)}}

    def glossy(self, node, groups):
        """Glossy and Anisotropic BSDF: the colour multiplies at every facet."""
        keys = self.rough(node, groups)
        return {"conductor": {**keys, "color": self.color(node, "Color", groups)}}

    def metallic(self, node, groups):
        """Metallic BSDF (4.3 and newer): complex IOR, or F82 tint."""
        keys = self.rough(node, groups)
        if node.fresnel_type == "PHYSICAL_CONDUCTOR":
            eta = evaluate(node.inputs["IOR"], groups)
            k = evaluate(node.inputs["Extinction"], groups)
            if isinstance(eta, tuple) and isinstance(k, tuple):
                return {"conductor": {**keys, "eta": list(eta), "k": list(k)}}
            self.warn("textured IOR or Extinction: magenta placeholder", node)
            return PLACEHOLDER
        f0 = self.color(node, "Base Color", groups)
        tint = self.color(node, "Edge Tint", groups)
        return {"conductor": {**keys, **self.f82(node, f0, tint)}}

    def f82(self, node, f0, tint):
        """Fresnel keys for Blender's edge tint, a factor on Schlick at cosθ = 1/7."""
        if tint == 1.0:
            return {"f0": f0}
        if isinstance(f0, dict) or isinstance(tint, dict):
            self.warn("a textured base colour or tint leaves out the edge tint", node)
            return {"f0": f0}
        f0 = f0 if isinstance(f0, list) else [f0] * 3
        tint = tint if isinstance(tint, list) else [tint] * 3
        at_82 = [(f + (1.0 - f) * (6.0 / 7.0) ** 5) * t for f, t in zip(f0, tint)]
        return {"f0": f0, "f82": at_82}

    def glass(self, node, groups):
        """Glass BSDF."""
        return {"dielectric": {**self.rough(node, groups),
                               "ior": self.constant(node, "IOR", groups),
                               "color": self.color(node, "Color", groups)}}

    def refraction(self, node, groups):
        """Refraction BSDF: as glass, for the format has no refraction alone."""
        self.warn("refraction alone is written as glass, which also reflects", node)
        return self.glass(node, groups)

    def emission(self, node, groups):
        """Emission: radiance = colour · strength, W·m⁻²·sr⁻¹."""
        return {"emission": {"color": self.color(node, "Color", groups, unit=False),
                             "strength": self.constant(node, "Strength", groups)}}

    def transparent(self, node, groups):
        """Transparent BSDF; its colour can't be textured."""
        color = self.color(node, "Color", groups)
        if isinstance(color, dict):
            self.warn("a textured transparent colour is left out: written as white", node)
            color = 1.0
        return {"transparent": {"color": color}}

    def mix(self, node, groups):
        """Mix Shader; a factor from Fresnel or Layer Weight has no counterpart."""
        factor = self.scalar(node, 0, groups, 0.0, 1.0) if not self.view_dependent(node, groups) \
            else self.normal_incidence(node, groups)
        if factor == 0.0:
            return self.closure(node.inputs[1], groups)
        if factor == 1.0:
            return self.closure(node.inputs[2], groups)
        return {"mix": {"factor": factor,
                        "a": self.closure(node.inputs[1], groups),
                        "b": self.closure(node.inputs[2], groups)}}

    def view_dependent(self, node, groups):
        """Whether a mix factor is a Fresnel or Layer Weight node."""
        source = follow(node.inputs[0], groups)
        return source.linked and source.node.type in {"FRESNEL", "LAYER_WEIGHT"}

    def normal_incidence(self, node, groups):
        """The Fresnel reflectance at normal incidence in place of a view-dependent factor."""
        source = follow(node.inputs[0], groups)
        if source.node.type == "FRESNEL":
            ior = self.constant(source.node, "IOR", source.groups)
        else:  # Layer Weight: Blender's own map from Blend to an IOR
            blend = self.constant(source.node, "Blend", source.groups)
            ior = 1.0 / max(1.0 - blend, 1e-5)
        f0 = ((ior - 1.0) / (ior + 1.0)) ** 2
        self.warn(f"{source.node.bl_label} as a factor depends on the view: "
                  f"replaced by {f0:.4g}, its value at normal incidence", node)
        return f0

    def add(self, node, groups):
        """Add Shader: only what stands first, except that an empty side changes nothing."""
        sides = [s for s in node.inputs if follow(s, groups).linked]
        if not sides:
            return BLACK
        if len(sides) == 2:
            dropped = follow(sides[1], groups).node
            self.warn(f'a sum of shaders can\'t be carried: "{dropped.name}" is left out', node)
        return self.closure(sides[0], groups)

    def principled(self, node, groups):
        """Principled BSDF: metal, glass or Lambert, mixed by Metallic and Transmission."""
        def first(*names):
            return next(n for n in names if n in node.inputs)

        for names, off in (
            (("Subsurface Weight", "Subsurface"), 0.0),
            (("Coat Weight", "Clearcoat"), 0.0),
            (("Sheen Weight", "Sheen"), 0.0),
            (("Thin Film Thickness",), 0.0),
            (("Diffuse Roughness",), 0.0),
        ):
            present = next((n for n in names if n in node.inputs), None)
            if present and self.scalar(node, present, groups) != off:
                self.warn(f"{present} is left out", node)

        base = self.color(node, "Base Color", groups)
        metallic = self.scalar(node, "Metallic", groups, 0.0, 1.0)
        transmission = self.scalar(node, first("Transmission Weight", "Transmission"), groups, 0.0, 1.0)
        keys = self.principled_rough(node, groups)

        surface = None
        if metallic != 1.0:
            if transmission != 1.0:
                self.warn("the specular layer over the diffuse base is left out: Lambert", node)
            surface = _mix(
                transmission,
                {"diffuse": {"color": base}},
                {"dielectric": {**keys, "ior": self.constant(node, "IOR", groups), "color": base}})
        if metallic != 0.0:
            tint = 1.0
            if "Specular IOR Level" in node.inputs:  # 4.0 and newer: F82 tint
                tint = self.color(node, "Specular Tint", groups)
            metal = {"conductor": {**keys, **self.f82(node, base, tint)}}
            surface = _mix(metallic, surface, metal)

        strength = self.constant(node, "Emission Strength", groups)
        if strength != 0.0:
            glow = self.color(node, first("Emission Color", "Emission"), groups, unit=False)
            if glow != 0.0:
                self.warn("emission on top of a surface is left out", node)
        alpha = self.scalar(node, "Alpha", groups, 0.0, 1.0)
        return _mix(alpha, {"transparent": {}}, surface)

    def principled_rough(self, node, groups):
        """Rough keys of Principled, whose anisotropy turns the other way round:
        aspect = √(1 − 0.9 a), α_x = r²/aspect, α_y = r² · aspect."""
        keys, _ = self.distribution(node)
        roughness = self.scalar(node, "Roughness", groups, 0.0, 1.0)
        anisotropy = self.scalar(node, "Anisotropic", groups, 0.0, 1.0)
        if anisotropy == 0.0:
            return {**keys, "roughness": roughness}
        if isinstance(roughness, dict) or isinstance(anisotropy, dict):
            self.warn("Anisotropic with a texture on it or on Roughness is left out", node)
            return {**keys, "roughness": roughness}
        aspect = (1.0 - 0.9 * anisotropy) ** 0.5
        keys["alpha_x"] = min(roughness ** 2 / aspect, 1.0)
        keys["alpha_y"] = roughness ** 2 * aspect
        rotation = self.scalar(node, "Anisotropic Rotation", groups)
        if rotation != 0.0:
            keys["rotation"] = rotation
        return {**keys, **self.tangent(node, groups)}


def _mix(factor, a, b):
    """`b`'s share is `factor`; no mix at all at the ends."""
    if factor == 0.0:
        return a
    if factor == 1.0:
        return b
    return {"mix": {"factor": factor, "a": a, "b": b}}


_CLOSURES = {
    "BSDF_DIFFUSE": _Surface.diffuse,
    "BSDF_GLOSSY": _Surface.glossy,
    "BSDF_ANISOTROPIC": _Surface.glossy,
    "BSDF_METALLIC": _Surface.metallic,
    "BSDF_GLASS": _Surface.glass,
    "BSDF_REFRACTION": _Surface.refraction,
    "BSDF_TRANSPARENT": _Surface.transparent,
    "BSDF_PRINCIPLED": _Surface.principled,
    "EMISSION": _Surface.emission,
    "MIX_SHADER": _Surface.mix,
    "ADD_SHADER": _Surface.add,
}
