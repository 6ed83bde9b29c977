"""Judge exported cases against Cycles: right, told, silent, or refused.

    python3 blender/judge_cases.py CASES [--spp N] [--estimator NAME] [--only NAME]... [--json FILE]

CASES holds a folder per case: scene.yaml and what belongs to it, cycles.exr, and
case.json with the export's `warnings` (or its `error`). A case is *right* when the
mean of the rendered image is within 0.6 % of Cycles' and means of 4 × 4 pixels,
clipped to 1, differ by at most 1.2 % on average; *told* when it is not and a
warning says so; else *silent*. A scene that does not load is *refused*. Exits
with 1 where a case is silent or refused.
"""

import argparse
import json
import os
import subprocess
import sys

import numpy as np

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "smithwalk_export"))

import exr  # noqa: E402
from command import program  # noqa: E402

BIAS, LOOK = 0.006, 0.012
# What the exporter says of every file is no explanation of a difference.
_ALWAYS = ("have no counterpart", "--denoise")


def blocks(pixels, size=4):
    """Means over blocks; what is left over at the edges is left out."""
    height, width = (n // size * size for n in pixels.shape[:2])
    return pixels[:height, :width].reshape(height // size, size, width // size, size, 3).mean(axis=(1, 3))


def crop(scene):
    """The region that the export says to render, as (x0, y0, x1, y1), or None: it is no part of a scene."""
    with open(scene, encoding="utf-8") as f:
        words = next((line.split() for line in f if "as options of `smithwalk render`" in line), [])
    return tuple(map(int, words[words.index("--crop") + 1].split(","))) if "--crop" in words else None


def differences(ours, theirs):
    """Relative difference of the means, and the mean relative difference of the blocks."""
    bias = ours.mean() / theirs.mean() - 1.0
    a, b = (blocks(np.minimum(i, 1.0)) for i in (ours, theirs))
    return float(bias), float(np.abs(a - b).mean() / b.mean())


def judge(folder, options):
    """(verdict, bias, look, what the export said)."""
    with open(os.path.join(folder, "case.json"), encoding="utf-8") as f:
        case = json.load(f)
    if "skipped" in case or "script_error" in case:
        return "skipped", None, None, [case.get("skipped") or case["script_error"]]
    if "error" in case:
        return "refused", None, None, [case["error"]]
    said = [w for w in case["warnings"] if not any(a in w for a in _ALWAYS)]
    scene, out = (os.path.join(folder, name) for name in ("scene.yaml", "smithwalk.exr"))
    region = crop(scene)
    if region:
        options = [*options, "--crop", ",".join(map(str, region))]
    done = subprocess.run([program(), "render", scene, "-o", out, *options],
                          check=False, capture_output=True, text=True)
    if done.returncode:
        return "refused", None, None, [done.stderr.strip()[:300]]
    ours, theirs = (exr.read(p)["Combined"][..., :3].astype(np.float64)
                    for p in (out, os.path.join(folder, "cycles.exr")))
    if region and theirs.shape[:2] > ours.shape[:2]:
        x0, y0, x1, y1 = region
        theirs = theirs[y0:y1, x0:x1]
    if ours.shape != theirs.shape:
        return ("told" if said else "silent"), None, None, said + [f"{ours.shape} against {theirs.shape}"]
    if not theirs.any():
        return ("right" if not ours.any() else "silent"), 0.0, 0.0, said
    bias, look = differences(ours, theirs)
    right = abs(bias) <= BIAS and look <= LOOK
    return ("right" if right else "told" if said else "silent"), bias, look, said


def main():
    """All cases of a folder."""
    parser = argparse.ArgumentParser(prog="judge_cases.py", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases")
    parser.add_argument("--spp", default="256")
    parser.add_argument("--estimator", default="auto")
    parser.add_argument("--only", action="append", default=[])
    parser.add_argument("--json")
    args = parser.parse_args()
    names = sorted(n for n in os.listdir(args.cases) if os.path.exists(os.path.join(args.cases, n, "case.json")))
    found = {}
    for name in names:
        if args.only and name not in args.only:
            continue
        verdict, bias, look, said = judge(os.path.join(args.cases, name),
                                          ["--spp", args.spp, "--estimator", args.estimator])
        found[name] = {"verdict": verdict, "bias": bias, "look": look, "said": said}
        figures = "" if bias is None else f"mean {100 * bias:+7.2f} %  blocks {100 * look:6.2f} %"
        print(f"{verdict:8} {name:28} {figures:34} {'' if verdict == 'right' else '; '.join(said)[:160]}", flush=True)
    counts = {v: sum(f["verdict"] == v for f in found.values())
              for v in ("right", "told", "silent", "refused", "skipped")}
    total = len(found) - counts["skipped"]
    print(f"{total} cases: " + ", ".join(f"{n} {v}" for v, n in counts.items())
          + f"; {100 * counts['right'] / max(total, 1):.1f} % right")
    if args.json:
        with open(args.json, "w", encoding="utf-8") as f:
            json.dump({"counts": counts, "cases": found}, f, indent=1, ensure_ascii=False)
            f.write("\n")
    return 1 if counts["silent"] or counts["refused"] else 0


if __name__ == "__main__":
    sys.exit(main())
