"""Running a program, for the scripts that measure."""

import os
import subprocess
import sys


def run(command, **environment):
    """Run to the end; its standard output. Leaves with what it said when it fails."""
    done = subprocess.run(command, env={**os.environ, **environment}, capture_output=True,
                          text=True, check=False)
    if done.returncode:
        sys.exit(f"{' '.join(command)}\nfailed:\n{done.stdout}{done.stderr}")
    return done.stdout
