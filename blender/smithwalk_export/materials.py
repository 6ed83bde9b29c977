"""Blender's materials and their textures in the scene, each under a name of its own."""

import math
from collections import defaultdict
from dataclasses import replace

import bpy
import numpy as np

from . import bake
from .audit import Audit
from .bake import uniform
from .images import pixels_of
from .log import Log
from .meshes import BAKED, unique_name
from .surfaces import Surface


class MaterialWriter:
    """Translates each Blender material, once for each site it is baked at; owns the textures."""

    def __init__(self, images, log, audit):
        self.images = images
        self.log = log
        self.audit = audit
        self.materials = {}     # name in the scene → material
        self.textures = {}      # name in the scene → texture
        self.radial_axes = {}   # name in the scene → axes its tangents turn about
        self.steepness = defaultdict(float)  # name in the scene → metres that its bumps rise per width of their image
        self._heights = {}      # name in the scene of a texture → (its image or array, how often it repeats)
        self._looked_up = {}    # name in the scene → textures of UV maps or colours of vertices
        self._current = None    # the material that is written
        self.perturbed = set()  # names in the scene of those with normals or heights from textures
        self._names = {}        # (Blender's name_full or None, site key) → name in the scene
        self._textures = {}
        self._needs = {}

    def needs(self, material):
        """What of a material has to be baked."""
        key = material.name_full if material else None
        if key not in self._needs:
            recorder = bake.Recorder()
            if material is not None:
                probe = MaterialWriter(None, Log(), Audit())
                probe.radial_axes["probe"] = set()
                Surface(probe, material, "probe", recorder).translate()
            self._needs[key] = recorder.needs
        return self._needs[key]

    def add(self, material, site=None):
        """The name in the scene of a Blender material (None: Cycles' default surface)."""
        key = (material.name_full if material else None, site.key if site else None)
        if key not in self._names:
            name = unique_name(material.name if material else "default", self.materials)
            self._names[key] = name
            self.radial_axes[name] = set()
            self.materials[name] = None  # reserves the name
            self._current = self._looked_up[name] = []
            self.materials[name] = Surface(self, material, name, _Baked(self, material, site)).translate()
        return self._names[key]

    def attributes(self, names):
        """The UV maps and colours of vertices that these materials look up."""
        textures = [t for name in names for t in self._looked_up[name]]
        return {t.uv_map for t in textures if t.uv_map}, {t.colors for t in textures if t.colors}

    def looks_along(self, names):
        """Whether one of these materials asks for the directions of UVs."""
        return not self.perturbed.isdisjoint(names)

    @staticmethod
    def is_own(uv_map):
        """Whether every mesh has this UV map, or the active one for None, as its own file's."""
        active = (next((l.name for l in m.uv_layers if l.active_render), None) for m in bpy.data.meshes)
        return uv_map is None or all(name in {None, uv_map} for name in active)

    def texture(self, texture, where):
        """The name in the scene of a texture, or None when its image has no pixels."""
        if self.images is None:  # a probe
            return "probe"
        if self.is_own(texture.uv_map):
            texture = replace(texture, uv_map=None)
        self._current.append(texture)
        key = replace(texture, channel=None, image=texture.image and texture.image.name_full)
        if key not in self._textures and texture.colors:
            self._textures[key] = self._add_texture(
                texture.colors, {"colors": texture.colors, "color_space": texture.color_space})
        if key not in self._textures:
            file = self.images.add(texture.image, where)
            name = None
            if file:
                entry = {"file": file, "color_space": texture.color_space}
                if texture.uv_map:
                    entry["uv_map"] = texture.uv_map
                if texture.interpolation != "bilinear":
                    entry["interpolation"] = texture.interpolation
                if texture.extension != "repeat":
                    entry["extension"] = texture.extension
                alpha = self.images.alpha(texture, file)
                if alpha:
                    entry["alpha"] = alpha
                (a, b, c), (d, e, f) = texture.matrix
                if b or d:
                    entry["matrix"] = [[a, b, c], [d, e, f]]
                else:
                    if (a, e) != (1.0, 1.0):
                        entry["scale"] = [a, e]
                    if (c, f) != (0.0, 0.0):
                        entry["offset"] = [c, f]
                name = self._add_texture(file, entry)
                self._heights[name] = texture.image, max(abs(x) for x in (a, b, d, e))
            self._textures[key] = name
        return self._textures[key]

    def peak(self, name):
        """The largest value of a texture's image, where that holds floats; else 1."""
        return self.images.peaks.get(self.textures[name].get("file"), 1.0) if self.images is not None else 1.0

    def _stored(self, name):
        """A texture's pixels, if it has any, and how often it repeats."""
        image, repeats = self._heights.get(name, (None, 0.0))
        return (pixels_of(image) if isinstance(image, bpy.types.Image) else image), repeats

    def tilt(self, name):
        """The angle in degrees by which the steepest tenth of the normals of a tangent-space map leans at least."""
        image, _ = self._stored(name)
        if image is None or image.shape[2] < 3:
            return 0.0
        some = 2.0 * image[::max(image.shape[0] // 256, 1), ::max(image.shape[1] // 256, 1), :3] - 1.0
        across = np.hypot(some[..., 0], some[..., 1])
        return float(np.percentile(np.degrees(np.arctan2(across, np.maximum(some[..., 2], 0.0))), 90.0))

    def slope(self, name):
        """The root mean square slope of the values of a texture, per unit of UVs."""
        image, repeats = self._stored(name)
        if image is None or image.shape[1] < 2:
            return 0.0
        rows = image[::max(image.shape[0] // 256, 1), :, :3].mean(axis=2)
        return math.sqrt(2.0 * float(np.square(np.diff(rows, axis=1)).mean())) * image.shape[1] * repeats

    def _add_texture(self, file, entry):
        name = unique_name(file.rsplit("/", 1)[-1].rsplit(".", 1)[0], self.textures)
        self.textures[name] = entry
        return name

    def baked_texture(self, site, material, request, image):
        """The name in the scene of a baked image."""
        key = (site.key, material.name_full, request)
        if key not in self._textures:
            rgba = np.ones((*image.shape[:2], 4), dtype=np.float32)
            rgba[..., :3] = np.where(np.isfinite(image), image, 0.0)
            label = unique_name(f"{material.name}_{request[1]}_{request[2] or 'all'}", ())
            file = self.images.save(rgba, f"baked_{label}", True, f'material "{material.name}"')
            name = None
            if file:
                entry = {"file": file, "color_space": "linear"}
                if site.uv is not None:
                    entry["uv_map"] = BAKED
                u0, v0, u1, v1 = site.bounds
                if site.bounds != (0.0, 0.0, 1.0, 1.0):
                    entry["scale"] = [1.0 / (u1 - u0), 1.0 / (v1 - v0)]
                    entry["offset"] = [-u0 / (u1 - u0), -v0 / (v1 - v0)]
                name = self._add_texture(file, entry)
                self._heights[name] = image, 1.0 / max(u1 - u0, 1e-6)
            self._textures[key] = name
        return self._textures[key]


class _Baked:
    """Results of a site for one material."""

    def __init__(self, writer, material, site):
        self.writer = writer
        self.material = material
        self.site = site

    def value(self, socket, groups, whole=False):
        """A tuple of three floats, `{"texture": NAME}`, or None where nothing was baked."""
        if self.site is None:
            return None
        request = bake.request(socket, groups, whole)
        image = self.site.results.get((self.material.name_full, request))
        if image is None:
            return None
        constant = uniform(image)
        if constant is not None:
            return constant
        name = self.writer.baked_texture(self.site, self.material, request, image)
        return {"texture": name} if name else None
