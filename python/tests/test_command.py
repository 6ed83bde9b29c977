"""What the package does by the command `smithwalk`; skipped where that or OpenEXR is not there."""

import os
import pathlib
import signal
import threading

import numpy as np
import pytest

import smithwalk

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILT = [ROOT / "target" / profile / "smithwalk" for profile in ("debug", "release")]
COMMAND = os.environ.get("SMITHWALK") or next((str(path) for path in BUILT if path.exists()), None)
needs_command = pytest.mark.skipif(COMMAND is None, reason="the command is not built")
FURNACE = ROOT / "scenes/furnace/scene.yaml"
SMALL = {"film.width": 16, "film.height": 12, "film.aovs": ["albedo", "depth"]}


@needs_command
def test_a_furnace_is_white_and_has_its_layers():
    pytest.importorskip("OpenEXR")
    told = []
    image = smithwalk.render(FURNACE, spp=16, settings=SMALL, progress=told.append, command=COMMAND)
    assert image.color.shape == (12, 16, 3) and image.color.dtype == np.float32
    # The world's light is what comes back from a white surface.
    assert abs(image.color.mean() / image.color[0, 0].mean() - 1.0) < 0.02
    assert image.layers["albedo"].shape == (12, 16, 3) and image.layers["depth"].shape == (12, 16, 1)
    assert told[-1]["spp"] == 16 and told[-1]["target"] == 16
    again = smithwalk.render(FURNACE, spp=16, settings=SMALL, threads=1, command=COMMAND)
    assert (again.color == image.color).all()


@needs_command
def test_a_mapping_is_a_scene():
    pytest.importorskip("OpenEXR")
    scene = {
        "smithwalk": 1,
        "camera": {"projection": {"perspective": {"lens": 50, "sensor_width": 36}}},
        "film": {"width": 4, "height": 4},
        "world": {"constant": {"color": [0.25, 0.5, 1.0], "strength": 2.0}},
        "materials": {},
        "meshes": {},
        "objects": [],
        "lights": [],
    }
    image = smithwalk.render(scene, spp=1, command=COMMAND)
    np.testing.assert_allclose(image.color[2, 2], [0.5, 1.0, 2.0], rtol=1e-6)
    with pytest.raises(smithwalk.RenderError, match="film"):
        smithwalk.render({**scene, "film": {"width": "wide"}}, command=COMMAND)


@needs_command
def test_ctrl_c_and_exceptions_end_a_render():
    pytest.importorskip("OpenEXR")

    class Enough(Exception):
        pass

    def stop(_):
        raise Enough

    with pytest.raises(Enough):
        smithwalk.render(FURNACE, time=60, settings=SMALL, progress=stop, command=COMMAND)
    # Shells start programs in the background deaf to Ctrl-C.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT)).start()
        with pytest.raises(KeyboardInterrupt):
            smithwalk.render(FURNACE, time=60, settings=SMALL, command=COMMAND)
    finally:
        signal.signal(signal.SIGINT, before)


@needs_command
def test_materials_of_scenes_are_what_the_package_computes():
    keys = {"distribution": "ggx", "alpha": 0.5, "color": [1.0, 0.71, 0.29]}
    scene, own = smithwalk.material({"conductor": keys}, command=COMMAND), smithwalk.conductor(**keys)
    wi, wo = smithwalk.spherical(0.6), smithwalk.spherical([0.9, 0.4], [1.0, 3.0])
    (a, a_error), (b, b_error) = scene.eval(wi, wo, samples=20_000), own.eval(wi, wo, samples=20_000)
    assert (np.abs(a - b) < 4.5 * np.hypot(a_error, b_error)).all()
    a, b = scene.albedo([0.9, 0.3], samples=100_000), own.albedo([0.9, 0.3], samples=100_000)
    assert (np.abs(a.reflected - b.reflected) < 4.5 * np.hypot(a.reflected_stderr, b.reflected_stderr) + 1e-6).all()


@needs_command
def test_principled_of_a_white_metal_keeps_what_cycles_3_kept():
    metal = smithwalk.principled(version=3.4, metallic=1.0, base_color=[1, 1, 1], roughness=1.0, distribution="multi_ggx", command=COMMAND)
    found = metal.albedo([0.9, 0.2], samples=20_000)
    assert found.reflected.shape == (2, 3) and (found.reflected > 0.97).all()
    with pytest.raises(ValueError, match="metalic"):
        smithwalk.principled(version=3.4, metalic=1.0, command=COMMAND).albedo(0.5)


def test_a_missing_command_is_named():
    with pytest.raises(FileNotFoundError, match="no-such-smithwalk"):
        smithwalk.principled(command="no-such-smithwalk")
