#!/usr/bin/env python3
"""Renders the gallery, single beside multiple scattering, and what the second costs.

    benches/gallery.py [--smithwalk BINARY] [--spp N] [--repeats N]

Writes docs/images/gallery-NAME.png and docs/gallery.md. A pair is rendered
alternately, so that whatever else the machine does falls on both; the figures
are CPU seconds as `smithwalk render` prints them, of rendering alone, which
include the light, the ground and the rays that miss the figure. Needs Pillow.
"""

import argparse
import os
import platform
import re
import statistics
import sys
import tempfile

from PIL import Image

from command import run

ROOT = os.path.normpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
SCENE = os.path.join(ROOT, "scenes", "gallery", "scene.yaml")
PIXELS = 192 * 256
GOLD = "[1, 0.71, 0.29]"
TEXTURE = "roughness: {texture: blotches}"

# Name of the picture, what it shows, the material, the talk's extra time in percent.
PICTURES = (
    ("gold", "gold, GGX, α = 1", f"conductor: {{alpha: 1, color: {GOLD}}}", 24),
    ("gold-textured", "gold, textured roughness 0.15 to 1",
     f"conductor: {{{TEXTURE}, color: {GOLD}}}", 27),
    ("glass-textured", "glass, textured roughness 0.15 to 1", f"dielectric: {{{TEXTURE}, ior: 1.5}}", 19),
    ("diffuse-0.1", "diffuse facets, α = 0.1", "rough_diffuse: {alpha: 0.1, color: [0.8, 0.5, 0.4]}", 87),
    ("diffuse-0.5", "diffuse facets, α = 0.5", "rough_diffuse: {alpha: 0.5, color: [0.8, 0.5, 0.4]}", 87),
    ("diffuse-1", "diffuse facets, α = 1", "rough_diffuse: {alpha: 1, color: [0.8, 0.5, 0.4]}", 87),
    ("glass-0.05", "glass, α = 0.05", "dielectric: {alpha: 0.05, ior: 1.5}", None),
    ("glass-0.4", "glass, α = 0.4", "dielectric: {alpha: 0.4, ior: 1.5}", None),
    ("glass-1", "glass, α = 1", "dielectric: {alpha: 1, ior: 1.5}", None),
)
ESTIMATORS = ("single", "auto")
# What is timed: with branches, noisier pixels would get more paths.
PLAIN_PATHS = ("-D", "sampling.branches=1")


def render(args, material, estimator, spp, seed, *outputs, options=()):
    """One image; CPU seconds."""
    command = [args.smithwalk, "render", SCENE, "-D", f"materials.figure={{{material}}}",
               "--estimator", estimator, "--spp", str(spp), "--seed", str(seed), *options]
    for output in outputs:
        command += ["-o", output]
    return float(re.search(r"\(([\d.]+) s CPU\)", run(command))[1])


def picture(args, name, material, folder):
    """Write the pair side by side."""
    path = {e: os.path.join(folder, e) for e in ESTIMATORS}
    for estimator in ESTIMATORS:
        render(args, material, estimator, args.spp, 1, path[estimator] + ".png", path[estimator] + ".exr")
    halves = [Image.open(path[e] + ".png").convert("RGB") for e in ESTIMATORS]
    width, height = halves[0].size
    pair = Image.new("RGB", (2 * width + 4, height), "white")
    pair.paste(halves[0], (0, 0))
    pair.paste(halves[1], (width + 4, 0))
    pair.save(os.path.join(ROOT, "docs", "images", f"gallery-{name}.png"), optimize=True)


def cost(args, material, folder):
    """Nanoseconds of CPU per sample, single and multiple; the ratios of all repeats."""
    times = {e: [] for e in ESTIMATORS}
    for repeat in range(args.repeats):
        for estimator in ESTIMATORS if repeat % 2 == 0 else ESTIMATORS[::-1]:
            times[estimator].append(render(args, material, estimator, args.timing_spp, 2 + repeat,
                                           os.path.join(folder, "timing.exr"), options=PLAIN_PATHS))
    ratios = sorted(m / s for s, m in zip(times["single"], times["auto"]))
    per_sample = [1e9 * statistics.median(times[e]) / (PIXELS * args.timing_spp) for e in ESTIMATORS]
    return per_sample, ratios


def processor():
    """The model name, or what the platform says."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            return next(line.split(":")[1].strip() for line in file if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


def page(args, rows):
    """docs/gallery.md."""
    version = run([args.smithwalk, "--version"]).strip()
    lines = [
        "# Gallery", "",
        "Single scattering on the left, all orders on the right, of the same material under the same",
        "light: a turned figure in a studio, lit by an environment map alone. These are the materials",
        "of the talk on the multiple-scattering Smith model (Heitz, Hanika, d'Eon and Dachsbacher,",
        f"SIGGRAPH 2016). {args.spp} samples per pixel; `benches/gallery.py` writes this page.", "",
        "## What multiple scattering costs", "",
        "Time per sample at the same number of samples, over a whole image: camera rays, light samples",
        "and the ground are in it. The talk's figures (24, 27, 19 and 87 %) come from other scenes, another",
        "renderer and another machine. They stand here in its order. The slide of the 87 % has no title: that",
        "it shows diffuse facets, beside which it stands, is a guess. For glass of constant roughness there is none.", "",
        "| material | single, ns | multiple, ns | extra time, median | range | the talk |",
        "|---|---|---|---|---|---|",
    ]
    for _, label, _, talk, (single, multiple), ratios in rows:
        low, middle, high = (100.0 * (r - 1.0) for r in (ratios[0], statistics.median(ratios), ratios[-1]))
        quoted = "–" if talk is None else f"{talk} %"
        lines.append(f"| {label} | {single:.0f} | {multiple:.0f} | {middle:+.0f} % "
                     f"| {low:+.0f} to {high:+.0f} % | {quoted} |")
    lines += [
        "",
        f"CPU time on {os.cpu_count()} threads of {processor()}, {version}, {args.timing_spp} samples per pixel,",
        f"{args.repeats} repeats with seeds of their own, single and multiple taking turns: medians, and the range of",
        "the ratios. Multiple scattering is evaluated by the default estimator. The times include longer",
        "paths: light that single scattering loses travels on.", "",
        "## Pictures", "",
    ]
    for name, label, material, *_ in rows:
        lines += [f"![{label}: single and multiple scattering](images/gallery-{name}.png)", "",
                  f"{label[0].upper()}{label[1:]}: `{material}`", ""]
    return "\n".join(lines[:-1]) + "\n"


def main():
    """Parse, render, write."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--smithwalk", default=os.path.join(ROOT, "target", "release", "smithwalk"))
    parser.add_argument("--spp", type=int, default=512, help="of the pictures")
    parser.add_argument("--timing-spp", type=int, default=64, help="of the renders that are timed")
    parser.add_argument("--repeats", type=int, default=7, help="pairs timed for each material")
    args = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name, label, material, talk in PICTURES:
            print(f"{label} …", file=sys.stderr, flush=True)
            picture(args, name, material, folder)
            rows.append((name, label, material, talk, *cost(args, material, folder)))
    text = page(args, rows)
    with open(os.path.join(ROOT, "docs", "gallery.md"), "w", encoding="utf-8") as file:
        file.write(text)
    print(text)


if __name__ == "__main__":
    main()
