"""The render engine: F12 runs the `smithwalk` binary on an export of the scene.

The binary is a process of its own: a crash of it never takes Blender down,
and one binary serves all versions. What needs Cycles (bakes, panoramas of
worlds) is taken from the cache that an export, or the button "Bake for
smithwalk", has filled: one render can't run inside another.
"""

import json
import os
import shutil
import signal
import subprocess
import tempfile
import threading
import time

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, PointerProperty, StringProperty

from . import settings
from .audit import DEFAULTS
from .files import SCENE
from .log import APPROXIMATE, WRONG
from .scene import CACHED, ExportError, Job

ENGINE = "SMITHWALK"
_NO_DENOISER = "Open Image Denoise 2"  # begins what the program says without its library
_POLL = 0.1          # seconds between looks at the process
_TO_STOP = 1.5       # seconds that a cancelled process has to end by itself
_PARTIAL = 5         # seconds between partial images
_REPORTED = 12       # warnings shown in Blender; the others are in the terminal
# Name in Blender, key in the scene file, channels' names, kind.
PASSES = (
    ("Albedo", "albedo", "RGB", "COLOR"),
    ("Normal", "normal", "XYZ", "VECTOR"),
    ("Depth", "depth", "Z", "VALUE"),
    ("Variance", "variance", "RGB", "COLOR"),
    ("Single", "single", "RGB", "COLOR"),
    ("Multiple", "multiple", "RGB", "COLOR"),
)


class SmithwalkSettings(bpy.types.PropertyGroup):
    """Settings of the scene that Cycles has none for."""

    estimator: EnumProperty(
        name="Estimator", description="How multiple scattering is computed",
        items=[(name, label, text) for name, label, text in (
            ("auto", "Auto", "The best one for each material"),
            ("walk", "Walk", "One random walk per evaluation: the reference"),
            ("two-walk", "Two walks", "Two walks, from both directions"),
            ("position-free", "Position-free", "Two walks with the depth integrated out"),
            ("single", "Single scattering", "Single scattering, which loses energy; as GGX of Cycles 4 and newer"),
            ("compensated", "Compensated", "Single scattering scaled to the albedo it should have"))])
    use_albedo: BoolProperty(name="Albedo")
    use_normal: BoolProperty(name="Normal")
    use_depth: BoolProperty(name="Depth")
    use_variance: BoolProperty(name="Variance", description="Of each pixel's mean")
    use_single: BoolProperty(name="Single", description="Light that was scattered once on each surface")
    use_multiple: BoolProperty(name="Multiple", description="Light that was scattered more than once on a surface")

    def passes(self):
        """The passes that are wanted, as in `PASSES`."""
        return [p for p in PASSES if getattr(self, f"use_{p[1]}")]


class SmithwalkPreferences(bpy.types.AddonPreferences):
    """Where the binary is, if not beside the add-on or on the PATH."""

    bl_idname = __package__

    binary: StringProperty(name="Binary", subtype="FILE_PATH",
                           description="The smithwalk program; empty: the add-on's own, or that on the PATH")

    def draw(self, _context):
        """The preferences' one line."""
        self.layout.prop(self, "binary")


def binary():
    """The path of the program; raises ExportError where there is none."""
    addon = bpy.context.preferences.addons.get(__package__)
    chosen = addon.preferences.binary if addon and addon.preferences else ""
    own = os.path.join(os.path.dirname(__file__), "bin", "smithwalk" + (".exe" if os.name == "nt" else ""))
    for path in (bpy.path.abspath(chosen) if chosen else "", os.environ.get("SMITHWALK", ""), own,
                 shutil.which("smithwalk") or ""):
        if path and os.path.isfile(path):
            if not os.access(path, os.X_OK):  # extensions are unpacked without the bit
                os.chmod(path, 0o755)
            return path
    raise ExportError("the smithwalk program was not found: name it in the add-on's preferences")


def environment():
    """The program's environment: newer Blenders bring the denoiser that it can use."""
    home = os.path.dirname(bpy.app.binary_path or bpy.__file__)
    own = os.path.join(home, "lib")
    found = os.path.exists(os.path.join(own, "libOpenImageDenoise.so.2"))
    return {**os.environ, "OIDN_DIR": os.environ.get("OIDN_DIR", own)} if found else dict(os.environ)


class SmithwalkEngine(bpy.types.RenderEngine):
    """Final renders by smithwalk."""

    bl_idname = ENGINE
    bl_label = "smithwalk"
    bl_use_preview = False
    bl_use_eevee_viewport = True
    bl_use_shading_nodes_custom = False
    bl_use_spherical_stereo = False

    def update_render_passes(self, scene=None, renderlayer=None):
        """Tell Blender which passes there will be."""
        self.register_pass(scene, renderlayer, "Combined", 4, "RGBA", "COLOR")
        for name, _, channels, kind in scene.smithwalk.passes():
            self.register_pass(scene, renderlayer, name, len(channels), channels, kind)

    def render(self, depsgraph):
        """Render one view layer. Called by Blender for each, outside of the main thread."""
        with tempfile.TemporaryDirectory(prefix="smithwalk-") as folder:
            try:
                self._render(depsgraph, folder)
            except ExportError as error:
                self._fail(str(error))
            except OSError as error:
                self._fail(f"{error.strerror or error}: {error.filename or ''}")

    def _fail(self, text):
        self.report({"ERROR"}, f"smithwalk: {text}")
        if hasattr(self, "error_set"):
            self.error_set(f"smithwalk: {text}")

    def _render(self, depsgraph, folder):
        scene = depsgraph.scene
        layer = depsgraph.view_layer
        self.update_stats("", "smithwalk: exporting")
        DEFAULTS.prepare()
        job = Job(scene, folder, bake=CACHED, layer=layer.name, by_engine=True,
                  progress=lambda what, share: self.update_stats("", f"smithwalk: {what} {100 * share:.0f} %"))
        job.prepare_from(depsgraph)
        log = job.write(depsgraph)
        self._tell(log)

        region = settings.border(scene.render)
        width, height = settings.resolution(scene.render)
        if region:
            width, height = region[2] - region[0], region[3] - region[1]
        out = os.path.join(folder, "out.exr")
        command = [binary(), "render", os.path.join(folder, SCENE), "-o", out,
                   "--estimator", scene.smithwalk.estimator, *log.options]
        passes = scene.smithwalk.passes()
        if passes:
            command += ["-D", "film.aovs=[" + ", ".join(key for _, key, _, _ in passes) + "]"]
        if scene.render.threads_mode == "FIXED":
            command += ["--threads", str(scene.render.threads)]
        command += ["--progress", "json", "--checkpoint", str(_PARTIAL)]

        def partial():
            """The image of the checkpoint that was just saved."""
            shown = os.path.join(folder, "partial.exr")
            done = subprocess.run([command[0], "merge", out + ".film", "-o", shown], capture_output=True, check=False)
            if done.returncode == 0:
                self._hand_over(shown, layer.name, width, height, passes)

        ended = self._run(command, layer.name, partial)
        if ended is not None and settings.DENOISE in command and _NO_DENOISER in ended:
            self.report({"WARNING"}, f"smithwalk: not denoised: {ended}")
            command.remove(settings.DENOISE)
            ended = self._run(command, layer.name, partial)
        if ended is not None:
            self._fail(ended)
        if os.path.isfile(out):
            self._hand_over(out, layer.name, width, height, passes)

    def _tell(self, log):
        losses = log.of(WRONG, APPROXIMATE)
        for entry in losses[:_REPORTED]:
            self.report({"WARNING"}, f"smithwalk: {entry}")
        if len(losses) > _REPORTED:
            self.report({"WARNING"}, f"smithwalk: {len(losses) - _REPORTED} more differences, see the terminal")
        print(log.summary())

    def _run(self, command, layer, partial):
        """Run the program to its end; an error's text, or None. Cancelling stops it.

        `partial` is called after each checkpoint.
        """
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                   encoding="utf-8", errors="replace", env=environment())
        lines, readers = [], []
        for pipe in (process.stdout, process.stderr):
            readers.append(threading.Thread(target=lambda pipe=pipe: lines.extend(iter(pipe.readline, "")), daemon=True))
            readers[-1].start()
        shown, checkpoint = 0, None
        while process.poll() is None:
            if self._cancelled():
                _stop(process)
                break
            while shown < len(lines):
                latest = self._show(lines[shown], layer)
                shown += 1
                if latest is not None and latest != checkpoint:
                    checkpoint = latest
                    partial()
            time.sleep(_POLL)
        for reader in readers:
            reader.join(timeout=1.0)
        if process.returncode in {0, None} or self._cancelled():
            return None
        said = [line.strip() for line in lines if line.strip() and not line.startswith("{")]
        return " ".join(said[-5:])[:500] or f"the program ended with {process.returncode}"

    def _cancelled(self):
        """Whether the user wants no more of this."""
        return self.test_break()

    def _show(self, line, layer):
        """Progress: a JSON object per line. Returns when the last checkpoint was, if there was one."""
        if not line.startswith("{"):
            return None
        try:
            said = json.loads(line)
        except ValueError:
            return None
        spp, target, left = said["spp"], said["target"], said["eta"]
        self.update_progress(min(spp / target, 1.0))
        text = f"smithwalk: {spp:.0f} of {target} samples"
        if said["noise"] is not None:
            text += f", noise {said['noise']:.3g}"
        self.update_stats(layer, text if left is None else f"{text}, {left:.0f} s left")
        return said["checkpoint"]

    def _hand_over(self, path, layer, width, height, passes):
        """Give the file's pixels to Blender, bit for bit."""
        from .exr import read
        images = read(path)
        result = self.begin_result(0, 0, width, height, layer=layer)
        if result is None:
            return
        try:
            found = result.layers[0].passes
            combined = images["Combined"]
            if "denoised" in images:
                combined = np.concatenate([images["denoised"], combined[..., 3:]], axis=-1)
            if combined.shape[:2] != (height, width):
                raise ExportError(f"an image of {width} × {height} was expected, "
                                  f"not {combined.shape[1]} × {combined.shape[0]}")
            _put(found["Combined"], combined)
            for name, key, _, _ in passes:
                if name in found and key in images:
                    _put(found[name], images[key])
        finally:
            self.end_result(result)


def _put(render_pass, pixels):
    """Pixels (height, width, channels), top row first, into a pass."""
    flat = pixels[::-1].reshape(-1, pixels.shape[2])
    if bpy.app.version >= (4, 0, 0):
        render_pass.rect.foreach_set(flat.ravel())
    else:
        render_pass.rect = flat.tolist()


def _stop(process):
    """End a process within two seconds."""
    process.send_signal(signal.SIGINT if os.name != "nt" else signal.SIGTERM)
    try:
        process.wait(timeout=_TO_STOP)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


class SMITHWALK_OT_bake(bpy.types.Operator):
    """Let Cycles bake what only it can evaluate, and render the world, for renders by smithwalk"""

    bl_idname = "smithwalk.bake"
    bl_label = "Bake for smithwalk"

    def execute(self, context):
        """Fill the cache that renders read."""
        with tempfile.TemporaryDirectory(prefix="smithwalk-") as folder:
            try:
                job = Job(context.scene, folder)
                job.prepare()
            except (ExportError, RuntimeError, OSError) as error:
                self.report({"ERROR"}, str(error))
                return {"CANCELLED"}
        self.report({"INFO"}, f"{len(job.baker.sites)} bake(s) ready")
        return {"FINISHED"}


class SMITHWALK_PT_render(bpy.types.Panel):
    """The engine's own settings; all others are Cycles'."""

    bl_label = "smithwalk"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"
    COMPAT_ENGINES = {ENGINE}

    @classmethod
    def poll(cls, context):
        """Shown for this engine alone."""
        return context.engine == ENGINE

    def draw(self, context):
        """The settings, and the bake."""
        layout = self.layout
        layout.use_property_split = True
        layout.prop(context.scene.smithwalk, "estimator")
        layout.operator(SMITHWALK_OT_bake.bl_idname)


class SMITHWALK_PT_passes(bpy.types.Panel):
    """The passes beside Combined."""

    bl_label = "Passes"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "view_layer"
    COMPAT_ENGINES = {ENGINE}

    @classmethod
    def poll(cls, context):
        """Shown for this engine alone."""
        return context.engine == ENGINE

    def draw(self, context):
        """A box per pass."""
        column = self.layout.column(heading="Include")
        for _, key, _, _ in PASSES:
            column.prop(context.scene.smithwalk, f"use_{key}")


_CLASSES = (SmithwalkSettings, SmithwalkPreferences, SmithwalkEngine, SMITHWALK_OT_bake, SMITHWALK_PT_render,
            SMITHWALK_PT_passes)
# Cycles' panels for what only Cycles does.
_NOT_SHARED = ("denois", "guiding", "performance", "debug", "viewport", "passes", "preview", "curves")


def _shared_panels():
    """Blender's own panels, and Cycles' for settings that are carried."""
    for panel in bpy.types.Panel.__subclasses__():
        engines = getattr(panel, "COMPAT_ENGINES", None)
        if engines is None:
            continue
        name = panel.__name__.lower()
        if "BLENDER_RENDER" in engines or ("CYCLES" in engines and not any(w in name for w in _NOT_SHARED)):
            yield panel


def _prepare_defaults():
    DEFAULTS.prepare()


def register():
    """Register the engine, its settings and panels."""
    for cls in _CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Scene.smithwalk = PointerProperty(type=SmithwalkSettings)
    for panel in _shared_panels():
        # A set of the panel's own: Cycles' panels share one.
        panel.COMPAT_ENGINES = set(panel.COMPAT_ENGINES) | {ENGINE}
    if not bpy.app.background:  # in the main thread, before any render asks for them
        bpy.app.timers.register(_prepare_defaults, first_interval=0.1)


def unregister():
    """Undo `register`."""
    for panel in bpy.types.Panel.__subclasses__():
        engines = getattr(panel, "COMPAT_ENGINES", ())
        if ENGINE in engines and not panel.__name__.startswith("SMITHWALK"):
            panel.COMPAT_ENGINES = set(engines) - {ENGINE}
    del bpy.types.Scene.smithwalk
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)


