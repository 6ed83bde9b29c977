"""The renderer's command, for the scripts of this folder."""

import os
import shutil
import sys


def program():
    """Its path: SMITHWALK, the built one, or the PATH's."""
    built = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "target", "release", "smithwalk")
    for path in (os.environ.get("SMITHWALK"), built, shutil.which("smithwalk")):
        if path and os.path.isfile(path):
            return path
    sys.exit("the smithwalk program was not found: set SMITHWALK")
