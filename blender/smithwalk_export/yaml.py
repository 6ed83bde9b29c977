"""A minimal YAML writer: blocks down to a given depth, flow style below it.

Blender ships no YAML module; the scene format needs maps, lists, numbers,
booleans and strings only.
"""

import json
import math
import re
import struct

_PLAIN = re.compile(r"[A-Za-z_][A-Za-z0-9_./-]*\Z")
_WORDS = {"true", "false", "null", "yes", "no", "on", "off", "y", "n"}


def number(x):
    """A float in up to nine significant digits: every float32 survives exactly."""
    if not math.isfinite(x):
        raise ValueError(f"{x} can't be written to a scene")
    text = f"{x:.9g}"
    if abs(x) < 3e38:  # the shortest that is the same float32
        single = struct.pack("f", x)
        text = next((t for t in (f"{x:.6g}", f"{x:.7g}", f"{x:.8g}")
                     if struct.pack("f", float(t)) == single), text)
    return "0" if text == "-0" else text


def flow(value):
    """One value on one line."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return number(value)
    if isinstance(value, str):
        plain = _PLAIN.match(value) and value.lower() not in _WORDS
        return value if plain else json.dumps(value, ensure_ascii=False)
    if isinstance(value, dict):
        return "{" + ", ".join(f"{flow(str(k))}: {flow(v)}" for k, v in value.items()) + "}"
    return "[" + ", ".join(flow(v) for v in value) + "]"


def document(sections, note=None):
    """The whole file: top-level maps and lists get a line per entry."""
    lines = [f"# {line}" for line in note.splitlines()] if note else []
    for key, value in sections.items():
        if isinstance(value, dict) and value:
            lines.append(f"{key}:")
            lines += [f"  {flow(str(k))}: {flow(v)}" for k, v in value.items()]
        elif isinstance(value, list) and value:
            lines.append(f"{key}:")
            lines += [f"  - {flow(v)}" for v in value]
        else:
            lines.append(f"{key}: {flow(value)}")
    return "\n".join(lines) + "\n"
