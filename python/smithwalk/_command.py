"""What the renderer does, by its command `smithwalk` as a process of its own.

Embree is not linked into the package: it is a library of 40 MB, and the model's wheel half a
megabyte. A process ends within a tile's sample when it is told to, can't take the
interpreter with it, and renders the same bits as the command line.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Image = NDArray[np.float32]
Progress = Callable[[dict[str, Any]], object]


class RenderError(RuntimeError):
    """The command's message: of a scene file with line, column and what was expected."""


class Render(NamedTuple):
    """A rendered image, scene-linear, rows from the top."""

    color: Image
    """Radiance, (height, width, 3), or 4 with alpha where the film is transparent."""
    layers: dict[str, Image]
    """The film's AOVs by name, (height, width, channels): `film: {aovs: [albedo, depth, …]}`."""
    messages: str
    """What the command said: time, rays per second, what was left out, warnings."""


def find(command: str | os.PathLike[str] | None) -> str:
    """The command: as given, by the variable SMITHWALK, or on the path."""
    given = command or os.environ.get("SMITHWALK") or "smithwalk"
    found = shutil.which(given)
    if found is None:
        raise FileNotFoundError(
            f"command: {os.fspath(given)!r} is not there; build it with `cargo build --release`, and pass its path or set SMITHWALK"
        )
    return found


def render(
    scene: str | os.PathLike[str] | Mapping[str, Any],
    *,
    spp: int | None = None,
    time: float | None = None,
    noise: float | None = None,
    seed: int | None = None,
    threads: int | None = None,
    estimator: str | None = None,
    settings: Mapping[str, Any] | None = None,
    folder: str | os.PathLike[str] = ".",
    progress: Progress | None = None,
    command: str | os.PathLike[str] | None = None,
) -> Render:
    """Renders a scene file, or a scene given as a mapping of the same keys.

    `spp`: samples per pixel; `time`: seconds; `noise`: relative error to stop at; these, `seed`,
    `threads` and `estimator` as of `smithwalk render`. `settings`: values of the scene by path,
    such as `{'film.width': 64}`. `folder`: what files in a mapping are relative to; the scene is
    written there for the time of the render. `progress`: called twice a second with `spp`,
    `target`, `elapsed` and `eta` (seconds or None) and `noise`. Ctrl-C, or an exception in
    `progress`, ends the render and goes on to the caller. `command`: path of `smithwalk`; default
    the variable SMITHWALK, or what is on the path.
    Needs the extra `smithwalk[render]`, the package OpenEXR.
    """
    import OpenEXR

    program = find(command)
    arguments = ["--progress", "json", "--checkpoint", "0"]
    limits = {"spp": spp, "time": time, "noise": noise, "seed": seed, "threads": threads, "estimator": estimator}
    for name, value in limits.items():
        if value is not None:
            arguments += [f"--{name}", str(value)]
    for path, value in (settings or {}).items():
        arguments += ["-D", f"{path}={json.dumps(value)}"]
    with tempfile.TemporaryDirectory(prefix="smithwalk-") as place:
        image = Path(place, "image.exr")
        if isinstance(scene, Mapping):
            # JSON is YAML.
            with tempfile.NamedTemporaryFile("w", dir=folder, prefix=".scene-", suffix=".yaml") as file:
                json.dump(scene, file)
                file.flush()
                messages = _run([program, "render", file.name, "-o", image, *arguments], progress)
        else:
            messages = _run([program, "render", scene, "-o", image, *arguments], progress)
        with OpenEXR.File(str(image), separate_channels=True) as file:
            channels = {name: channel.pixels for name, channel in file.channels().items()}
    groups: dict[str, list[str]] = {}
    for name in channels:
        groups.setdefault(name.rpartition(".")[0], []).append(name)
    order = "RGBAXYZ"
    layers = {
        group: np.stack([channels[n] for n in sorted(names, key=lambda n: order.find(n[-1]))], axis=-1)
        for group, names in groups.items()
    }
    return Render(layers.pop(""), layers, messages)


def _run(arguments: list[Any], progress: Progress | None) -> str:
    """Runs the command to its end, and gives what it said beside its progress."""
    # A session of its own: Ctrl-C comes here, and from here once to the command.
    process = subprocess.Popen(
        [os.fspath(a) for a in arguments],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        encoding="utf-8",
        start_new_session=True,
    )
    said = []
    try:
        assert process.stderr is not None
        for line in process.stderr:
            if not line.startswith("{"):
                said.append(line)
            elif progress is not None:
                progress(json.loads(line))
        code = process.wait()
    except BaseException:
        process.send_signal(signal.SIGINT)
        process.communicate()
        raise
    messages = "".join(said)
    if code != 0:
        raise RenderError(messages.strip() or f"the command ended with {code}")
    return messages


class SceneMaterial:
    """A material of the scene format, measured by the command; made by `material` and `principled`."""

    def __init__(self, description: Mapping[str, Any], command: str | os.PathLike[str] | None):
        self._yaml = json.dumps(description)
        self._command = find(command)

    def __repr__(self) -> str:
        return f"smithwalk.material({self._yaml})"

    def _ask(self, measurement: str, *arguments: str) -> Any:
        """What the command says of the material, from JSON."""
        done = subprocess.run(
            [self._command, "bsdf", measurement, "--material", self._yaml, "--json", *arguments],
            capture_output=True,
            encoding="utf-8",
        )
        if done.returncode != 0:
            raise ValueError(done.stderr.strip())
        return json.loads(done.stdout)

    def eval(
        self, wi: ArrayLike, wo: ArrayLike, *, samples: int = 64, seed: int = 0
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """f(wi, wo) |cosθ_o| in 1/sr: (value, stderr), both (…, 3). A process, some ms, for each pair."""
        from . import _pairs

        wi, wo, shape = _pairs(wi, wo)
        value, error = np.empty((2, len(wi), 3))
        for point, (a, b) in enumerate(zip(wi, wo)):
            # Paths of a renderer begin at the eye: its wo is where the walk begins.
            directions = [f"--{name}={','.join(map(repr, map(float, v)))}" for name, v in (("wo", a), ("wi", b))]
            found = self._ask("eval", *directions, f"--samples={samples}", f"--seed={seed + point}")
            value[point], error[point] = found["value"], found["se"]
        return value.reshape(*shape, 3), error.reshape(*shape, 3)

    def albedo(self, cos: ArrayLike, *, samples: int = 100_000, seed: int = 0):
        """Directional albedos at cosines `cos` of wi, as `Material.albedo`; `orders` are as many as any walk had."""
        from . import Albedo

        cos = np.asarray(cos, float)
        listed = ",".join(map(repr, map(float, cos.ravel())))
        rows = self._ask("albedo", f"--cos={listed}", f"--samples={samples}", f"--seed={seed}")
        columns = [np.array([row[key] for row in rows]).reshape(*cos.shape, 3) for key in ("r", "r_se", "t", "t_se")]
        orders = np.zeros((len(rows), max(len(row["orders"]) for row in rows)))
        for shares, row in zip(orders, rows):
            shares[: len(row["orders"])] = row["orders"]
        mean = np.array([row["mean_order"] for row in rows]).reshape(cos.shape)
        return Albedo(*columns, orders.reshape(*cos.shape, -1), mean)


def material(description: Mapping[str, Any], *, command: str | os.PathLike[str] | None = None) -> SceneMaterial:
    """A material as in a scene file, such as `{'mix': {...}}`: what scenes are made of beyond the model.

    Its closures (Blender's and OpenPBR's nodes, mixes, sheen, textures' constants) are compiled by
    the renderer, so the command `smithwalk` is needed (see `render`); Ctrl-C ends it.
    """
    return SceneMaterial(description, command)


def principled(*, command: str | os.PathLike[str] | None = None, **keys: Any) -> SceneMaterial:
    """Blender's Principled BSDF with the keys of the scene format: `version` (3.4, 4.5, 5.0), `base_color`, …"""
    return SceneMaterial({"principled": keys}, command)
