"""Image files beside the scene: copied, unpacked, or converted to PNG or EXR."""

import itertools
import os
import shutil
import tempfile

import bpy
import numpy as np

from . import exr
from .meshes import unique_name
from .nodes import color_space

# What the renderer reads, by the first bytes of the file.
_SIGNATURES = [
    (b"\x89PNG", ".png"),
    (b"\xff\xd8\xff", ".jpg"),
    (b"\x76\x2f\x31\x01", ".exr"),
    (b"#?RADIANCE", ".hdr"),
    (b"#?RGBE", ".hdr"),
]


def _known_extension(head):
    return next((ext for magic, ext in _SIGNATURES if head.startswith(magic)), None)


def pixels_of(image):
    """The stored values, (height, width, channels), bottom row first; None without pixels."""
    width, height = image.size
    if not width or not height:
        return None
    values = np.empty(width * height * image.channels, dtype=np.float32)
    try:
        image.pixels.foreach_get(values)
    except (RuntimeError, TypeError):
        return None
    return values.reshape(height, width, image.channels)


class ImageWriter:
    """Writes each Blender image once; the name of the file is its identity."""

    def __init__(self, files, log):
        self.files = files
        self.log = log
        self._written = {}  # image name_full → file name or None
        self.peaks = {}     # file name → the largest value of one that holds floats

    def add(self, image, where):
        """The file name of an image, or None (with a warning) if it has no pixels."""
        key = image.name_full
        if key not in self._written:
            write = self._write_tiles if image.source == "TILED" else self._write
            file = self._written[key] = write(image, where)
            if file and image.is_float and file not in self.peaks:  # copied as it is
                pixels = pixels_of(image)
                self.peaks[file] = 1.0 if pixels is None else _peak(pixels)
        return self._written[key]

    def alpha(self, texture, file):
        """The `alpha` key of a texture in this file: what Cycles does to its colour, or None.

        Cycles multiplies by alpha as it loads what files hold unmultiplied (all but EXR), and
        divides by it again where alpha is asked for, too.
        """
        if texture.alpha is None or not self._has_alpha(texture.image):
            return None
        multiplied = file.endswith(".exr")
        if texture.alpha == "asked":
            return "divide" if multiplied else "weigh"
        return None if multiplied else "multiply"

    @staticmethod
    def _has_alpha(image):
        if image.channels != 4:
            return False
        pixels = pixels_of(image)
        return pixels is None or bool((pixels[..., 3] < 1.0).any())

    def _write_tiles(self, image, where):
        """The files of a tiled image under one name with `<UDIM>`."""
        pattern = bpy.path.abspath(image.filepath, library=image.library)
        folder, name = os.path.split(pattern)
        sources = {tile.number: os.path.join(folder, name.replace("<UDIM>", str(tile.number)))
                   for tile in image.tiles}
        extensions = set()
        for source in sources.values():
            try:
                with open(source, "rb") as f:
                    extensions.add(_known_extension(f.read(16)))
            except OSError as error:
                self.log.wrong(where, f'image "{image.name}": {source}: {error.strerror}')
                return None
        if "<UDIM>" not in name or image.packed_files or len(extensions) != 1 or None in extensions:
            self.log.wrong(where, f'image "{image.name}": only tiles in PNG, JPEG, EXR or HDR files of one kind, '
                                  "not packed, are written")
            return None
        stem = unique_name(name.split("<UDIM>")[0].strip("._") or image.name, ())
        extension = extensions.pop()
        for n in itertools.count(1):
            base = stem if n == 1 else f"{stem}_{n}"
            wanted = {f"{base}.{number}{extension}": source for number, source in sources.items()}
            made = {name: path for path, name in map(self.files.new, wanted)}
            if made.keys() == wanted.keys():
                break
            for taken in made:
                self.files.drop(taken)
        for file, source in wanted.items():
            shutil.copyfile(source, made[file])
        return f"{base}.<UDIM>{extension}"

    def _write(self, image, where):
        if image.source not in {"FILE", "GENERATED"}:
            self.log.warn(where, f'image "{image.name}" is a {image.source.lower()}: '
                                 "only its current frame is written")
        stem = os.path.splitext(os.path.basename(image.filepath) or image.name)[0]
        stem = unique_name(stem, ())
        if image.source == "FILE" and not image.packed_file \
                and not os.path.isfile(image.filepath_from_user()) and not image.has_data:
            self.log.wrong(where, f'image "{image.name}": no such file: {image.filepath_from_user()}')
            return None

        if color_space(image) == "linear":
            return self._linearise(image, stem, where)
        # The bytes as they are, when the renderer can read them: lossless.
        if not image.is_dirty and image.source == "FILE":
            if image.packed_file:
                data = image.packed_file.data
                extension = _known_extension(data[:16])
                if extension:
                    path, name = self.files.new(stem + extension)
                    with open(path, "wb") as f:
                        f.write(data)
                    return name
            elif os.path.isfile(image.filepath_from_user()) and image.size[0]:
                source = image.filepath_from_user()
                with open(source, "rb") as f:
                    extension = _known_extension(f.read(16))
                if extension:
                    inside = self.files.inside(source)
                    if inside:
                        return inside
                    path, name = self.files.new(stem + extension)
                    shutil.copyfile(source, path)
                    return name
        return self._convert(image, stem, where)

    def _convert(self, image, stem, where):
        rgba = self._rgba(image, where)
        return None if rgba is None else self.save(rgba, stem, image.is_float, where)

    def _linearise(self, image, stem, where):
        """An image of a colour space that the renderer does not know, as scene-linear EXR."""
        rgba = self._rgba(image, where)
        if rgba is None:
            return None
        if not image.is_float:  # of floats Blender has converted the values already
            rgba[..., :3] = scene_linear(rgba[..., :3], image.colorspace_settings.name)
            if image.alpha_mode in {"STRAIGHT", "PREMUL"}:
                rgba[..., :3] *= rgba[..., 3:]
        return self.save(rgba, stem, True, where)

    def _rgba(self, image, where):
        pixels = pixels_of(image)
        if pixels is None:
            self.log.wrong(where, f'image "{image.name}" has no pixels')
            return None
        rgba = np.ones((*pixels.shape[:2], 4), dtype=np.float32)
        if pixels.shape[2] == 1:
            rgba[..., :3] = pixels
        else:
            rgba[..., :pixels.shape[2]] = pixels
        return rgba

    def save(self, rgba, stem, is_float, where):
        """Write an array (bottom row first) as EXR or 8-bit PNG; the file's name, or None."""
        path, name = self.files.new(stem + (".exr" if is_float else ".png"))
        try:
            save_image(path, rgba, is_float)
        except RuntimeError as error:
            self.files.drop(name)
            self.log.wrong(where, f'image "{stem}" can\'t be written: {error}')
            return None
        if is_float:
            self.peaks[name] = _peak(rgba)
        return name


def _peak(pixels):
    finite = pixels[..., :3][np.isfinite(pixels[..., :3])]
    return float(finite.max()) if finite.size else 0.0


def save_image(path, rgba, is_float):
    """Write stored values, (height, width, 4), bottom row first, as they are."""
    height, width, _ = rgba.shape
    image = bpy.data.images.new("smithwalk", width, height, alpha=True, float_buffer=is_float)
    try:
        image.colorspace_settings.name = "Non-Color"
        image.alpha_mode = "CHANNEL_PACKED"
        image.pixels.foreach_set(np.ascontiguousarray(rgba, dtype=np.float32).ravel())
        image.filepath_raw = path
        image.file_format = "OPEN_EXR" if is_float else "PNG"
        image.save()
    finally:
        bpy.data.images.remove(image)


def mean_color(image):
    """The mean of an image in scene-linear light, or None without pixels."""
    pixels = pixels_of(image)
    if pixels is None or not pixels.size:
        return None
    pixels = np.repeat(pixels, 3, axis=2) if pixels.shape[2] == 1 else pixels[..., :3]
    if not image.is_float and color_space(image) != "non_color":
        pixels = scene_linear(pixels, image.colorspace_settings.name)
    return tuple(float(c) for c in pixels.mean(axis=(0, 1), dtype=np.float64))


def scene_linear(pixels, space):
    """8-bit values (height, width, 3) of a colour space, by Blender's own colour management."""
    height, width, _ = pixels.shape
    image = bpy.data.images.new("smithwalk", width, height)
    scene = bpy.data.scenes.new("smithwalk")
    try:
        image.colorspace_settings.name = space
        rgba = np.ones((height, width, 4), dtype=np.float32)
        rgba[..., :3] = pixels
        image.pixels.foreach_set(rgba.ravel())
        settings = scene.render.image_settings
        if hasattr(settings, "media_type"):
            settings.media_type = "IMAGE"
        settings.file_format, settings.color_mode, settings.color_depth = "OPEN_EXR", "RGB", "32"
        settings.exr_codec = "ZIP"
        with tempfile.TemporaryDirectory(prefix="smithwalk-") as folder:
            path = os.path.join(folder, "linear.exr")
            image.save_render(path, scene=scene)
            return exr.read(path)["Combined"][::-1, :, :3]
    finally:
        bpy.data.images.remove(image)
        bpy.data.scenes.remove(scene)
