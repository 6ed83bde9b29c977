"""The folder of an export: written beside, then renamed; nobody else's file is touched.

The first line of scene.yaml lists what the export wrote. The next export to
the same folder may replace these files, and removes those that it no longer
needs; every other file in the folder keeps its name and content.
"""

import json
import os
import shutil
import tempfile

SCENE = "scene.yaml"
_MARK = "# smithwalk-export: "


class Folder:
    """Files on their way into a folder."""

    def __init__(self, path, scene_name=SCENE):
        os.makedirs(path, exist_ok=True)
        self.path = path
        self.scene_name = scene_name
        self._before = self._earlier_export()
        self._taken = {f.lower() for f in os.listdir(path)} - {f.lower() for f in self._before}
        self.beside = tempfile.mkdtemp(prefix=".smithwalk-", dir=path)
        self._names = []

    def _earlier_export(self):
        path = os.path.join(self.path, self.scene_name)
        if not os.path.exists(path):
            return []
        with open(path, encoding="utf-8", errors="replace") as f:
            first = f.readline()
        if not first.startswith(_MARK):
            raise FileExistsError(17, "this scene was not written by the exporter and is left as it is", path)
        try:
            names = json.loads(first[len(_MARK):])
        except ValueError:
            names = []
        return [self.scene_name] + [n for n in names if isinstance(n, str) and n == os.path.basename(n)]

    def new(self, name):
        """A path to write a file to now, and the name it will have: `name`, or `name` with a number."""
        stem, extension = os.path.splitext(name)
        candidate, n = name, 2
        while candidate.lower() in self._taken:
            candidate, n = f"{stem}_{n}{extension}", n + 1
        self._taken.add(candidate.lower())
        self._names.append(candidate)
        return os.path.join(self.beside, candidate), candidate

    def paths(self):
        """Where the files are now, by the names that they will have."""
        return {name: os.path.join(self.beside, name) for name in self._names}

    def drop(self, name):
        """Take back a name from `new` that no file was written for."""
        self._names.remove(name)
        path = os.path.join(self.beside, name)
        if os.path.exists(path):
            os.remove(path)

    def inside(self, path):
        """The path relative to the folder for a file that lies in it already, else None."""
        relative = os.path.relpath(os.path.realpath(path), os.path.realpath(self.path))
        if relative.startswith("..") or os.path.isabs(relative):
            return None
        return None if relative in self._before else relative.replace(os.sep, "/")

    def commit(self, scene_text):
        """Move everything to its place, scene.yaml last; returns the path of scene.yaml."""
        scene = os.path.join(self.beside, self.scene_name)
        with open(scene, "w", encoding="utf-8") as f:
            f.write(_MARK + json.dumps(self._names, ensure_ascii=False) + "\n" + scene_text)
        for name in self._names + [self.scene_name]:
            os.replace(os.path.join(self.beside, name), os.path.join(self.path, name))
        for name in set(self._before) - set(self._names) - {self.scene_name}:
            stale = os.path.join(self.path, name)
            if os.path.isfile(stale):
                os.remove(stale)
        self.close()
        return os.path.join(self.path, self.scene_name)

    def close(self):
        """Remove what was not moved."""
        shutil.rmtree(self.beside, ignore_errors=True)
