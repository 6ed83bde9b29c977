"""Animations: one scene file, and for each frame a small file of what is otherwise in it.

Every frame is exported as it would be by itself. What all frames have alike is the
scene; paths to whatever differs in any of them go into the files of all, so that the
renderer builds once what stands still. Files of the same content are kept once.
"""

import hashlib
import os
import shutil
import tempfile

from . import yaml
from .files import Folder
from .log import Log

_DIGITS = 4
_NAMED = ("textures", "materials", "meshes")
_LISTS = ("objects", "lights")
_BLACK = {"constant": {"color": [0.0, 0.0, 0.0]}}


def export_frames(frames, folder, sections_of):
    """Write scene.yaml and a file per frame to `folder`; returns the Log.

    `sections_of(number, folder, log)` exports one frame: its sections, their files (name
    in the sections → path), and a note and options of `smithwalk render`.
    """
    files = Folder(folder)
    log = Log()
    known = {}
    shots = {}
    try:
        for number in frames:
            beside = tempfile.mkdtemp(dir=files.beside)
            sections, made, note, options = sections_of(number, beside, log)
            names = {name: _keep(path, name, number, not shots, files, known) for name, path in made.items()}
            shots[number] = _renamed(sections, names)
            shutil.rmtree(beside)
            if len(shots) == 1:
                log.options, first_note = options, note
        _unite(list(shots.values()))
        changes = differences(list(shots.values()))
        for number, sections in shots.items():
            path, _ = files.new(f"frame_{_padded(number)}.yaml")
            with open(path, "w", encoding="utf-8") as f:
                for change in changes:
                    f.write(f"{yaml.flow('.'.join(change))}: {yaml.flow(_value(sections, change))}\n")
        scene = dict(next(iter(shots.values())))
        for change in changes:
            if len(change) == 1:
                scene.setdefault(change[0], _value(scene, change))
        scene["frames"] = f"frame_{'#' * _DIGITS}.yaml"
        log.path = files.commit(yaml.document(scene, note=first_note))
        for kind in _LISTS + _NAMED:
            log.count(kind, len(scene.get(kind, ())))
        log.count("frames", len(shots))
        return log
    finally:
        files.close()


def _padded(number):
    return f"{'-' if number < 0 else ''}{abs(number):0{_DIGITS}d}"


def _keep(path, name, number, first, files, known):
    """Take a frame's file into the folder, unless one of the same content is there; its name."""
    with open(path, "rb") as f:
        content = hashlib.file_digest(f, "sha256").digest() if hasattr(hashlib, "file_digest") \
            else hashlib.sha256(f.read()).digest()
    stem, extension = os.path.splitext(name)
    key = (content, extension)
    if key not in known:
        target, known[key] = files.new(name if first else f"{stem}_{_padded(number)}{extension}")
        shutil.move(path, target)
    return known[key]


def _renamed(value, names):
    """The sections with the files' names as they are in the folder."""
    if isinstance(value, dict):
        return {k: names.get(v, v) if k in {"file", "lut"} and isinstance(v, str) else _renamed(v, names)
                for k, v in value.items()}
    return [_renamed(v, names) for v in value] if isinstance(value, list) else value


def _unite(shots):
    """Give all frames the names of each: what a frame does not use is not read."""
    for section in _NAMED:
        names = {}
        for shot in shots:
            for name, value in shot.get(section, {}).items():
                names.setdefault(name, value)
        if names:
            for shot in shots:
                shot[section] = {**names, **shot.get(section, {})}


def differences(shots):
    """The paths (tuples of keys and indices as text) to what is not alike in all of the frames."""
    found = []
    for section in dict.fromkeys(key for shot in shots for key in shot):
        values = [_value(shot, (section,)) for shot in shots]
        if all(v == values[0] for v in values):
            continue
        if section == "world" or not all(_shape(section, v) == _shape(section, values[0]) for v in values):
            found.append((section,))
            continue
        items = range(len(values[0])) if section in _LISTS else values[0]
        for item in items:
            found += [(section, str(item), *path) for path in _within(section, [v[item] for v in values])]
    return found


def _shape(section, value):
    """What two frames must have alike, so that single entries of a section can be replaced."""
    if section == "objects":
        return [entry.get("name") for entry in value]
    if section == "lights":
        return [(kind, keys.get("name")) for entry in value for kind, keys in entry.items()]
    return list(value)


def _within(section, values):
    """Paths below an entry: single keys where all frames have the same ones, else the whole."""
    if all(v == values[0] for v in values):
        return []
    if section == "lights":
        kind = next(iter(values[0]))
        return [(kind, *path) for path in _within("objects", [v[kind] for v in values])]
    if section in {"objects", "meshes"} and all(v.keys() == values[0].keys() for v in values):
        return [(key,) for key in values[0] if any(v[key] != values[0][key] for v in values)]
    return [()]


def _value(sections, path):
    value = sections.get(path[0])
    if value is None:
        return _BLACK if path[0] == "world" else [] if path[0] in _LISTS else {}
    for key in path[1:]:
        value = value[int(key) if isinstance(value, list) else key]
    return value
