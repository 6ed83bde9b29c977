"""Export a .blend to a smithwalk scene: scene.yaml, OBJ meshes, images.

    blender -b file.blend --python blender/export.py -- OUT_DIR [options]
    PYTHONPATH=<bpy> python3 blender/export.py file.blend OUT_DIR [options]

Works in Blender 3.4, 4.5 and 5.0. The exit code is 0 only when a scene was
written; whatever the format can't carry is named in a summary at the end,
what is visibly wrong first. What only Cycles can evaluate is baked by it, with
a cache of earlier bakes in ~/.cache/smithwalk.
"""

import argparse
import os
import sys
import traceback

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))


def parse(args, with_file):
    """The command line."""
    parser = argparse.ArgumentParser(prog="export.py", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    if with_file:
        parser.add_argument("blend", help="the .blend file")
    parser.add_argument("out", help="the folder to write to")
    parser.add_argument("--strict", action="store_true",
                        help="exit with 3 when anything is visibly wrong or approximate")
    parser.add_argument("--json", metavar="FILE", help="write the warnings here, too")
    parser.add_argument("--no-bake", action="store_true",
                        help="let Cycles evaluate nothing; what that leaves is named")
    parser.add_argument("--bake-size", type=int, default=1024, metavar="PIXELS",
                        help="width of images baked over a surface (%(default)s)")
    parser.add_argument("--view-layer", metavar="NAME", help="instead of the first")
    parser.add_argument("--frames", metavar="A..B", type=_frames,
                        help="what moves from frame A to B, apart from what does not")
    return parser.parse_args(args)


def _frames(text):
    """Both ends included."""
    first, found, last = text.partition("..")
    try:
        numbers = range(int(first), int(last if found else first) + 1)
    except ValueError:
        numbers = ()
    if not numbers:
        raise argparse.ArgumentTypeError(f"expected A..B with A at most B, e.g. 1..250, not {text!r}")
    return numbers


def main(argv):
    """Parse the arguments, export, and return the exit code."""
    try:
        import bpy
    except ImportError:
        print("export.py: run it by `blender -b file.blend --python export.py -- OUT_DIR`,"
              " or with the bpy module on PYTHONPATH", file=sys.stderr)
        return 2
    try:
        import numpy  # noqa: F401
    except ImportError as error:
        print(f"export.py: Blender can't load numpy ({str(error).strip().splitlines()[0]}). Debian's Blender takes "
              "that of the first python3 on the PATH, which has to be Debian's own: "
              "PATH=/usr/bin:$PATH blender …", file=sys.stderr)
        return 2
    from smithwalk_export.scene import BAKE, NO_BAKE, ExportError, export

    with_file = not bpy.app.binary_path
    args = argv[1:] if with_file else (argv[argv.index("--") + 1:] if "--" in argv else [])
    try:
        args = parse(args, with_file)
    except SystemExit as stop:  # argparse
        return stop.code if isinstance(stop.code, int) else 2
    try:
        if with_file:
            if not os.path.isfile(args.blend):
                raise ExportError(f"no such file: {args.blend}")
            bpy.ops.wm.open_mainfile(filepath=os.path.abspath(args.blend))
        log = export(bpy.context.scene, args.out, bake=NO_BAKE if args.no_bake else BAKE, bake_size=args.bake_size,
                     layer=args.view_layer, frames=args.frames)
        if args.json:
            with open(args.json, "w", encoding="utf-8") as f:
                f.write(log.json())
    except (ExportError, RuntimeError, OSError) as error:
        print(f"export.py: {error}", file=sys.stderr)
        return 1
    except Exception:  # Blender would print it and exit with 0
        traceback.print_exc()
        return 1
    print(log.summary())
    if log.options:
        frames = f" --frames {args.frames[0]}..{args.frames[-1]}" if args.frames else ""
        print(f"Blender's settings: smithwalk render {log.path}{frames} {' '.join(log.options)}")
    return 3 if args.strict and log.strict_failure else 0


if __name__ == "__main__":
    code = main(sys.argv)
    sys.stdout.flush()
    sys.stderr.flush()
    # Interpreter shutdown with the bpy module can hang in a destructor, and
    # `sys.exit` inside `blender -b` is honoured only as an exit code.
    os._exit(code)
