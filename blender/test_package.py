"""Install the extension's zip into a fresh profile, and render with it.

    python3 blender/test_package.py ZIP BLENDER [ARGUMENT]...

BLENDER is a Blender from 4.2 on with its arguments, or a python3 that has its bpy module.
Exits with 1 where the extension can't be installed from disk, its program doesn't run,
or F12 gives no picture.
"""

import os
import subprocess
import sys
import tempfile

_INSIDE = '''
import os, sys
import bpy
bpy.ops.wm.read_factory_settings()
bpy.ops.extensions.package_install_files(filepath={zip!r}, repo="user_default", enable_on_install=True)
name = "bl_ext.user_default.smithwalk"
import importlib
engine = importlib.import_module(name + ".engine")
assert engine.binary().startswith({profile!r}), engine.binary()
scene = bpy.context.scene
scene.render.engine = engine.ENGINE
scene.render.resolution_x, scene.render.resolution_y, scene.cycles.samples = 96, 54, 8
scene.cycles.use_adaptive_sampling = False
scene.render.filepath = {out!r}
bpy.ops.render.render(write_still=True)
image = bpy.data.images.load({out!r})
values = list(image.pixels)
assert tuple(image.size) == (96, 54) and max(values[:]) > 0.2 and len(set(values)) > 100
print("rendered in", bpy.app.version_string, "by", os.path.relpath(engine.binary(), {profile!r}))
sys.stdout.flush()
os._exit(0)
'''


def main(package, command):
    """Run it; the exit code."""
    with tempfile.TemporaryDirectory() as profile:
        script = os.path.join(profile, "inside.py")
        with open(script, "w", encoding="utf-8") as f:
            f.write(_INSIDE.format(zip=os.path.abspath(package), profile=profile, out=os.path.join(profile, "f12.png")))
        environment = {k: v for k, v in os.environ.items() if k not in {"SMITHWALK", "LD_LIBRARY_PATH"}}
        environment["BLENDER_USER_RESOURCES"] = profile
        environment["PATH"] = "/usr/bin:/bin"
        arguments = ["--python", script] if "-b" in command else [script]
        done = subprocess.run([*command, *arguments], env=environment, check=False, text=True, capture_output=True)
    told = [line for line in done.stdout.splitlines() if line.startswith("rendered in")]
    if done.returncode or not told:
        print((done.stdout + done.stderr)[-3000:])
        return 1
    print(told[0])
    return 0


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    sys.exit(main(sys.argv[1], sys.argv[2:]))
