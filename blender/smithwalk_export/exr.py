"""The renderer's EXR files to arrays: scan lines, uncompressed or ZIP, halves or floats.

Blender's own reader gives single-layer images alone, and not in every
version the values bit for bit. The format: "OpenEXR File Layout",
https://openexr.com/en/latest/OpenEXRFileLayout.html.
"""

import struct
import zlib

import numpy as np

_MAGIC = b"\x76\x2f\x31\x01"
_TYPES = {0: np.dtype("<u4"), 1: np.dtype("<f2"), 2: np.dtype("<f4")}
_LINES = {0: 1, 2: 1, 3: 16}  # compression → scan lines in a chunk: none, ZIPS, ZIP


def _text(data, at):
    end = data.index(b"\0", at)
    return data[at:end].decode(), end + 1


def _header(data):
    at, attributes = 8, {}
    while data[at]:
        name, at = _text(data, at)
        _, at = _text(data, at)
        size, = struct.unpack_from("<i", data, at)
        attributes[name] = data[at + 4:at + 4 + size]
        at += 4 + size
    return attributes, at + 1


def _channels(data):
    at, found = 0, []
    while data[at]:
        name, at = _text(data, at)
        kind, = struct.unpack_from("<i", data, at)
        found.append((name, _TYPES[kind]))
        at += 16
    return found


def _unzip(data):
    """ZIP's predictor and the interleaving of low and high bytes undone."""
    raw = np.frombuffer(zlib.decompress(data), dtype=np.uint8).astype(np.int64)
    raw[1:] -= 128
    raw = np.cumsum(raw).astype(np.uint8)
    half = (len(raw) + 1) // 2
    out = np.empty(len(raw), dtype=np.uint8)
    out[0::2], out[1::2] = raw[:half], raw[half:]
    return out.tobytes()


def read_channels(path):
    """{channel: array (height, width) of float32}, top row first."""
    with open(path, "rb") as f:
        data = f.read()
    if data[:4] != _MAGIC:
        raise OSError(5, "not an EXR file", path)
    attributes, at = _header(data)
    compression = attributes["compression"][0]
    if compression not in _LINES:
        raise OSError(5, f"EXR compression {compression} is not read", path)
    x0, y0, x1, y1 = struct.unpack("<4i", attributes["dataWindow"])
    width, height = x1 - x0 + 1, y1 - y0 + 1
    channels = _channels(attributes["channels"])
    images = {name: np.zeros((height, width), dtype=np.float32) for name, _ in channels}
    lines = _LINES[compression]
    row = sum(kind.itemsize for _, kind in channels) * width
    for offset in struct.unpack_from(f"<{-(-height // lines)}Q", data, at):
        y, size = struct.unpack_from("<ii", data, offset)
        chunk = data[offset + 8:offset + 8 + size]
        count = min(lines, height - (y - y0))
        if size < row * count:
            chunk = _unzip(chunk)
        at_line = 0
        for line in range(y - y0, y - y0 + count):
            for name, kind in channels:
                images[name][line] = np.frombuffer(chunk, kind, width, at_line)
                at_line += kind.itemsize * width
    return images


def read(path):
    """{"Combined": (height, width, 4), "albedo": (height, width, 3), …}, top row first."""
    channels = read_channels(path)
    layers = {}
    for name in channels:
        layer, _, channel = name.rpartition(".")
        layers.setdefault(layer, []).append(channel)
    images = {}
    for layer, found in layers.items():
        order = [c for c in ("RGBA" if "R" in found else "XYZ") if c in found] or found
        images[layer or "Combined"] = np.stack(
            [channels[f"{layer}.{c}" if layer else c] for c in order], axis=-1)
    combined = images["Combined"]
    if combined.shape[2] == 3:  # opaque
        alpha = np.ones((*combined.shape[:2], 1), dtype=np.float32)
        images["Combined"] = np.concatenate([combined, alpha], axis=-1)
    return images
