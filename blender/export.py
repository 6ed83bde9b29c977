"""Export a .blend to a smithwalk scene: scene.yaml, OBJ meshes, images.

    blender -b file.blend --python blender/export.py -- OUT_DIR
    PYTHONPATH=<bpy> python3 blender/export.py file.blend OUT_DIR

Works in Blender 3.4, 4.5 and 5.0. The exit code is 0 only when a scene was
written; whatever the format can't carry is named on the way and counted in a
summary at the end. As an add-on (File > Export > smithwalk), install the
folder `smithwalk_export` beside this file as a zip archive.
"""

import os
import sys
import traceback

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))


def main(argv):
    """Parse the arguments, export, and return the exit code."""
    try:
        import bpy
    except ImportError:
        print("export.py: run it by `blender -b file.blend --python export.py -- OUT_DIR`,"
              " or with the bpy module on PYTHONPATH", file=sys.stderr)
        return 2
    from smithwalk_export.scene import ExportError, export

    if bpy.app.binary_path:
        args = argv[argv.index("--") + 1:] if "--" in argv else []
        usage = "blender -b file.blend --python export.py -- OUT_DIR"
        expected = 1
    else:
        args = argv[1:]
        usage = "python3 export.py file.blend OUT_DIR"
        expected = 2
    if len(args) != expected:
        print(f"usage: {usage}", file=sys.stderr)
        return 2

    try:
        if expected == 2:
            if not os.path.isfile(args[0]):
                raise ExportError(f"no such file: {args[0]}")
            bpy.ops.wm.open_mainfile(filepath=os.path.abspath(args[0]))
        log = export(bpy.context.scene, args[-1])
    except (ExportError, RuntimeError, OSError) as error:
        print(f"export.py: {error}", file=sys.stderr)
        return 1
    except Exception:  # Blender would print it and exit with 0
        traceback.print_exc()
        return 1
    print(log.summary())
    return 0


if __name__ == "__main__":
    code = main(sys.argv)
    sys.stdout.flush()
    sys.stderr.flush()
    # Interpreter shutdown with the bpy module can hang in a destructor, and
    # `sys.exit` inside `blender -b` is honoured only as an exit code.
    os._exit(code)
