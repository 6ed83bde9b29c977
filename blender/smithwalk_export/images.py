"""Image files beside the scene: copied, unpacked, or converted to PNG or EXR."""

import os
import shutil

import bpy

from .meshes import unique_name

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


class ImageWriter:
    """Writes each Blender image once; the name of the file is its identity."""

    def __init__(self, folder, log):
        self.folder = folder
        self.log = log
        self._files = {}  # image name_full → file name or None

    def add(self, image, where):
        """The file name of an image, or None (with a warning) if it has no pixels."""
        key = image.name_full
        if key not in self._files:
            self._files[key] = self._write(image, where)
        return self._files[key]

    def _write(self, image, where):
        if image.source not in {"FILE", "GENERATED"}:
            self.log.warn(where, f'image "{image.name}" is a {image.source.lower()}: '
                                 "only its current frame or first tile is written")
        stem = os.path.splitext(os.path.basename(image.filepath) or image.name)[0]
        taken = {os.path.splitext(f)[0] for f in self._files.values() if f}
        stem = unique_name(stem, taken)

        # The bytes as they are, when the renderer can read them: lossless.
        if not image.is_dirty and image.source == "FILE":
            if image.packed_file:
                extension = _known_extension(image.packed_file.data[:16])
                if extension:
                    with open(os.path.join(self.folder, stem + extension), "wb") as f:
                        f.write(image.packed_file.data)
                    return stem + extension
            else:
                path = image.filepath_from_user()
                if not os.path.isfile(path):
                    self.log.warn(where, f'image "{image.name}": no such file: {path}')
                    return None
                with open(path, "rb") as f:
                    extension = _known_extension(f.read(16))
                if extension:
                    target = os.path.join(self.folder, stem + extension)
                    if not (os.path.exists(target) and os.path.samefile(path, target)):
                        shutil.copyfile(path, target)
                    return stem + extension
        return self._convert(image, stem, where)

    def _convert(self, image, stem, where):
        copy = image.copy()
        try:
            if not copy.has_data and copy.pixels:  # reading `pixels` loads the file
                pass
            if not copy.has_data:
                self.log.warn(where, f'image "{image.name}" has no pixels')
                return None
            extension, kind = (".exr", "OPEN_EXR") if copy.is_float else (".png", "PNG")
            copy.filepath_raw = os.path.join(self.folder, stem + extension)
            copy.file_format = kind
            copy.save()
        except RuntimeError as error:
            self.log.warn(where, f'image "{image.name}" can\'t be written: {error}')
            return None
        finally:
            bpy.data.images.remove(copy)
        return stem + extension
