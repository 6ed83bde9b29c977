#!/usr/bin/env python3
"""What it saves to leave out what a scene does not need, and how threads scale.

    benches/leave_out.py [--smithwalk BINARY] [--spp N] [--repeats N]

Three tables, two for docs/leave-out.md and the last for docs/benchmarks.md. The
first renders every scene of scenes/, and the simplest one made plainer, with the
kernel that fits best and with the one that has everything (`--all-in`).
The second turns single features on and off by `-D`: used, unused but in the
kernel, left out. The third renders with one thread and with two. The commands
of a row take turns, and the order changes from repeat to repeat, so that
whatever else the machine does falls on all of them. Times per sample are CPU
seconds of rendering alone, as `smithwalk render` prints them, the median over
the repeats; start-up is reading the scene and building it, from `smithwalk info`.
"""

import argparse
import json
import os
import re
import statistics
import sys
import tempfile

import section
from command import run

ROOT = os.path.normpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))

PAGE = os.path.join(ROOT, "docs", "leave-out.md")
TITLE = "# Leaving out what a scene does not need\n"
GOLD = "{conductor: {roughness: 0.8, color: [1, 0.71, 0.29]}}"
BRUSHED = "{conductor: {roughness: 0.8, color: [1, 0.71, 0.29], anisotropy: 0.5}}"

# What makes the gold sphere plainer still.
PLAINER = (
    ("single scattering", ["sampling.estimator=single"]),
    ("Lambertian", ["materials.gold={diffuse: {color: 0.8}}"]),
    ("Lambertian, no lamp", ["materials.gold={diffuse: {color: 0.8}}", "lights=[]"]),
)

# Feature as `info` names it, the scene, and what makes it used and unused.
FEATURES = (
    ("multiple scattering", "gold_sphere", None, "sampling.estimator=single"),
    ("metals", "gold_sphere", None, "materials.gold={diffuse: {color: 0.8}}"),
    ("diffuse facets", "gold_sphere", "materials.gold={rough_diffuse: {roughness: 0.8}}",
     "materials.gold={diffuse: {color: 0.8}}"),
    ("Beckmann slopes", "gold_sphere",
     "materials.gold={conductor: {roughness: 0.8, color: [1, 0.71, 0.29], distribution: beckmann}}", None),
    ("anisotropy", "gold_sphere", f"materials.gold={BRUSHED}", None),
    ("transmission", "gold_sphere", "materials.gold={dielectric: {roughness: 0.8}}", None),
    ("mixes", "gold_sphere", f"materials.gold={{mix: {{a: {GOLD}, b: {GOLD}}}}}", None),
    ("transparent shadows", "gold_sphere", f"materials.gold={{mix: {{a: {GOLD}, b: {{transparent: {{}}}}}}}}", None),
    ("depth of field", "gold_sphere", "camera.depth_of_field={fstop: 2.8, focus_distance: 6}", None),
    ("area lights", "gold_sphere", None, "lights=[]"),
    ("textures", "gallery", None, f"materials.figure={GOLD}"),
    ("environment map", "gallery", None, "world={constant: {color: 0.5}}"),
)


def scene_file(name):
    """The path of a scene of the repository."""
    return os.path.join(ROOT, "scenes", name, "scene.yaml")


def turns(args, scene, variants, folder):
    """Renders with each list of options in turn; per variant (wall, CPU) seconds of every repeat."""
    times = [[] for _ in variants]
    for repeat in range(args.repeats):
        order = list(range(len(variants)))
        for index in order if repeat % 2 == 0 else order[::-1]:
            text = run([args.smithwalk, "render", scene_file(scene), "-o", os.path.join(folder, "out.exr"),
                        "--spp", str(args.spp), "--seed", str(repeat),
                        "-D", "sampling.branches=1", *variants[index]])
            found = re.search(r"spp in ([\d.]+) s \(([\d.]+) s CPU\)", text)
            times[index].append((float(found[1]), float(found[2])))
    return times


def pixels(scene):
    """How many a scene has."""
    with open(scene_file(scene), encoding="utf-8") as file:
        text = file.read()
    width, height = (re.search(rf"^  {side}: (\d+)", text, re.MULTILINE)[1] for side in ("width", "height"))
    return int(width) * int(height)


def per_sample(args, scene, times):
    """Median nanoseconds of CPU per sample."""
    return 1e9 * statistics.median(cpu for _, cpu in times) / (pixels(scene) * args.spp)


def saving(more, less):
    """Median percent of CPU time that `less` saves, pair by pair, and the range."""
    savings = sorted(100.0 * (1.0 - b[1] / a[1]) for a, b in zip(more, less))
    return f"{statistics.median(savings):+.1f} % ({savings[0]:+.1f} to {savings[-1]:+.1f})"


def info(args, scene, options):
    """Features in use, bytes, and the median start-up in seconds."""
    reports = [json.loads(run([args.smithwalk, "info", scene_file(scene), "--json", *options]))
               for _ in range(args.repeats)]
    used = {f["name"] for f in reports[0]["features"] if f["used"]}
    inside = {f["name"] for f in reports[0]["features"] if f["in_kernel"]}
    size = sum(entry["bytes"] for entry in reports[0]["bytes"])
    return used, inside, size, statistics.median(r["start_up_seconds"] for r in reports)


def whole_scenes(args, folder):
    """Every scene: the kernel that fits best against the one with everything."""
    lines = ["| scene | features in use | in its kernel | everything in, ns | fitting, ns | saved (range) "
             "| kB | start-up, ms |", "|---|---|---|---|---|---|---|---|"]
    rows = [(scene, scene, []) for scene in sorted(os.listdir(os.path.join(ROOT, "scenes")))
            if os.path.exists(scene_file(scene))]
    rows += [(f"gold_sphere, {what}", "gold_sphere", [x for change in changes for x in ("-D", change)])
             for what, changes in PLAINER]
    for name, scene, changes in rows:
        print(f"{name} …", file=sys.stderr, flush=True)
        used, inside, size, start = info(args, scene, changes)
        full, lean = turns(args, scene, [["--all-in", *changes], changes], folder)
        lines.append(f"| {name} | {len(used)} | {len(inside)} | {per_sample(args, scene, full):.0f} "
                     f"| {per_sample(args, scene, lean):.0f} | {saving(full, lean)} "
                     f"| {size / 1e3:.0f} | {1e3 * start:.1f} |")
    return lines


def features(args, folder):
    """Single features: used, unused, left out."""
    lines = ["| feature | scene | used, ns | unused, ns | left out, ns | saved by leaving out (range) "
             "| kB used / left out | start-up used / left out, ms |", "|---|---|---|---|---|---|---|---|"]
    for name, scene, used, unused in FEATURES:
        print(f"{name} …", file=sys.stderr, flush=True)
        used, unused = (["-D", change] if change else [] for change in (used, unused))
        has, _, bytes_used, start_used = info(args, scene, used)
        lacks, _, bytes_left, start_left = info(args, scene, unused)
        if name not in has or name in lacks:
            sys.exit(f"{name}: the options of its row do not turn it on and off")
        on, idle, out = turns(args, scene, [used, [*unused, "--all-in"], unused], folder)
        lines.append(f"| {name} | {scene} | {per_sample(args, scene, on):.0f} "
                     f"| {per_sample(args, scene, idle):.0f} | {per_sample(args, scene, out):.0f} "
                     f"| {saving(idle, out)} | {bytes_used / 1e3:.1f} / {bytes_left / 1e3:.1f} "
                     f"| {1e3 * start_used:.1f} / {1e3 * start_left:.1f} |")
    return lines


def threads(args, folder):
    """Wall time with one thread over that with two."""
    lines = ["| scene | 1 thread, s | 2 threads, s | speed-up (range) |", "|---|---|---|---|"]
    for scene in ("gold_sphere", "interior"):
        print(f"threads: {scene} …", file=sys.stderr, flush=True)
        one, two = turns(args, scene, [["--threads", "1"], ["--threads", "2"]], folder)
        ups = sorted(a[0] / b[0] for a, b in zip(one, two))
        walls = [statistics.median(wall for wall, _ in times) for times in (one, two)]
        lines.append(f"| {scene} | {walls[0]:.2f} | {walls[1]:.2f} "
                     f"| {statistics.median(ups):.2f} ({ups[0]:.2f} to {ups[-1]:.2f}) |")
    return lines


def main():
    """Parse, measure, write."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--smithwalk", default=os.path.join(ROOT, "target", "release", "smithwalk"))
    parser.add_argument("--spp", type=int, default=64, help="samples per pixel")
    parser.add_argument("--repeats", type=int, default=7, help="of every command")
    args = parser.parse_args()
    said = (f"{args.spp} samples per pixel, {args.repeats} repeats, {os.cpu_count()} cores; "
            "`benches/leave_out.py` writes this section.")
    with tempfile.TemporaryDirectory() as folder:
        text = "\n".join([
            "The path tracer is compiled for a few sets of features, and the leanest that fits is taken.",
            "CPU time per sample, median; the images are the same to the bit. " + said, "",
            *whole_scenes(args, folder), "",
            "Single features: a scene that uses one, the same scene without it in the kernel that has",
            "everything, and in the kernel that fits. Between used and unused the picture, and so the",
            "work, is another; memory is what `info` lists, without Embree's own.", "",
            *features(args, folder)])
        section.replace("What it saves", text, PAGE, TITLE)
        scaling = "\n".join([f"Wall time of rendering. {said}", "", *threads(args, folder)])
        section.replace("Threads", scaling)
    print(text + "\n\n" + scaling)


if __name__ == "__main__":
    main()
