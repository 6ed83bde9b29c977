#!/usr/bin/env python3
"""What the estimators of multiple scattering gain in the renderer.

    benches/estimators.py [--smithwalk BINARY] [--samples N] [--repeats N] [--only PART]

Writes docs/estimators.md. A square fills the view of an orthographic camera that
looks at it under an angle; one lamp, far away, lights it. So all pixels have the
same expectation, and the mean square of what two seeds differ by is twice the
variance of a pixel, whatever is in the tails. Efficiency is 1/(variance × CPU
seconds), the seconds being those of rendering alone as `smithwalk render` prints
them. The table is the efficiency of `auto`, and of `two-walk`, over that of
`walk`: above 1 they gain. The commands of a row take turns, in an order that
changes from repeat to repeat; every repeat has two seeds of its own, and the
range is that of the ratio over the repeats.
"""

import argparse
import json
import math
import os
import re
import statistics
import sys
import tempfile

import section
from command import run

ROOT = section.ROOT
PAGE = os.path.join(ROOT, "docs", "estimators.md")
TITLE = "# Estimators\n"
SIDE = 32  # pixels

# Name, material, which side of the surface the lamp is on.
MATERIALS = (
    ("conductor, GGX", "conductor: {{alpha: {a}}}", "above"),
    ("conductor, Beckmann", "conductor: {{alpha: {a}, distribution: beckmann}}", "above"),
    ("gold, complex IOR", "conductor: {{alpha: {a}, metal: gold}}", "above"),
    ("conductor, α_x : α_y = 4 : 1", "conductor: {{alpha_x: {wide}, alpha_y: {narrow}, rotation: 0.1}}", "above"),
    ("glass, reflected", "dielectric: {{alpha: {a}, ior: 1.5}}", "above"),
    ("glass, transmitted", "dielectric: {{alpha: {a}, ior: 1.5}}", "below"),
    ("diffuse facets", "rough_diffuse: {{alpha: {a}, color: 0.8}}", "above"),
)
ALPHAS = (0.05, 0.1, 0.2, 0.4, 0.7, 1)
COSINES = (0.95, 0.5, 0.15)
# The lamp is off the middle of the lobe by its width, atan α, nearer to the normal and in azimuth,
# but no further than this in degrees.
FURTHEST = 20
SMALL, LARGE = 1, 40  # the lamp's half angle, degrees
FAR = 1000  # metres to the lamp: across the square nothing changes

SCENES = ("brushed_metal", "furnace", "gallery", "gold_sphere", "interior", "rough_glass", "sphere_rows", "suzanne")
# A share of the samples that a scene has by itself, so that all take about as long.
SCENE_SPP = {"furnace": 16, "sphere_rows": 4, "suzanne": 2}


def lamp(side, alpha, cosine, half_angle):
    """A sphere seen from the square under `half_angle`, near the mirrored or the refracted view."""
    view, off = math.acos(cosine), min(math.atan(alpha), math.radians(FURTHEST))
    if side == "below":
        view = math.asin(math.sin(view) / 1.5)
    polar = max(view - off, 0)
    # The camera is on the side of −y.
    azimuth = math.radians(90) + off
    height = math.cos(polar) * (-1 if side == "below" else 1)
    at = [FAR * x for x in (math.sin(polar) * math.cos(azimuth), math.sin(polar) * math.sin(azimuth), height)]
    radius = FAR * math.sin(math.radians(half_angle))
    power = 4 * math.pi**2 * radius**2 / math.sin(math.radians(half_angle))**2
    return f"  - {{point: {{power: {power:.6g}, radius: {radius:.6g}, soft_falloff: false, transform: {{location: {at}}}}}}}"


def write_square(folder):
    """The mesh, with texture coordinates for the tangent."""
    with open(os.path.join(folder, "square.obj"), "w", encoding="utf-8") as file:
        file.write("v -9 -9 0\nv 9 -9 0\nv 9 9 0\nv -9 9 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
                   "f 1/1 2/2 3/3 4/4\n")


def write_scene(folder, material, cosine, lights):
    """The scene file; its path."""
    sine = math.sqrt(1 - cosine * cosine)
    text = f"""smithwalk: 1
light_units: cycles_4
camera:
  transform: {{look_at: {{from: [0, {-5 * sine}, {5 * cosine}], to: [0, 0, 0]}}}}
  projection: {{orthographic: {{scale: 0.5}}}}
film: {{width: {SIDE}, height: {SIDE}}}
sampling: {{max_bounces: 1, branches: 1}}
materials:
  square: {{{material}}}
meshes:
  square: {{file: square.obj}}
objects:
  - {{mesh: square, material: square}}
{lights}
"""
    path = os.path.join(folder, "scene.yaml")
    with open(path, "w", encoding="utf-8") as file:
        file.write(text)
    return path


class Measurement:
    """Variance and time of each estimator, repeat by repeat."""

    def __init__(self, args, folder, estimators):
        self.args, self.folder, self.estimators = args, folder, estimators
        self.work = {e: [] for e in estimators}
        self.relative = None

    def take(self, scene, spp, figure):
        """Render each pair of seeds in turn. `figure` is the key of `smithwalk diff` to go by."""
        for repeat in range(self.args.repeats):
            order = self.estimators if repeat % 2 == 0 else self.estimators[::-1]
            for estimator in order:
                images, seconds = [], 0.0
                for seed in (2 * repeat + 1, 2 * repeat + 2):
                    images.append(os.path.join(self.folder, f"{seed}.exr"))
                    said = run([self.args.smithwalk, "render", scene, "-o", images[-1], "--spp", str(spp),
                                "--seed", str(seed), "--estimator", estimator, "-D", "sampling.branches=1"])
                    seconds += float(re.search(r"\(([\d.]+) s CPU\)", said)[1])
                report = json.loads(run([self.args.smithwalk, "diff", *images, "--json"]))
                self.work[estimator].append((report[figure] / 2, seconds))
        return self

    def gain(self, estimator):
        """Efficiency over that of the walk, and its range over the repeats; None without noise.

        Times are summed over the repeats, as they differ by what else the machine does alone."""
        seconds = {e: sum(s for _, s in self.work[e]) for e in ("walk", estimator)}
        variance = {e: [v for v, _ in self.work[e]] for e in ("walk", estimator)}
        if not any(variance["walk"] + variance[estimator]):
            return None
        ratios = sorted(w * seconds["walk"] / max(v * seconds[estimator], 1e-30)
                        for w, v in zip(variance["walk"], variance[estimator]))
        mean = (statistics.mean(variance["walk"]) * seconds["walk"]
                / max(statistics.mean(variance[estimator]) * seconds[estimator], 1e-30))
        return mean, ratios[0], ratios[-1]


def cell(gain):
    """For the table."""
    if gain is None:
        return "no noise"
    mean, low, high = gain
    return f"{mean:.2f} ({low:.2f}–{high:.2f})"


def material_text(template, alpha):
    """With the roughness filled in; twice and half of it on the axes of an anisotropic one."""
    return template.format(a=alpha, wide=min(2 * alpha, 1), narrow=min(2 * alpha, 1) / 4)


def small_lamp(args, folder):
    """Material, roughness and angle under a small lamp."""
    lines = ["| material | α | " + " | ".join(f"cos {c}: auto | two-walk" for c in COSINES) + " |",
             "|---|---|" + "---|---|" * len(COSINES)]
    worst = {}
    for name, template, side in MATERIALS:
        for alpha in ALPHAS:
            print(f"{name}, α = {alpha} …", file=sys.stderr, flush=True)
            cells = []
            for cosine in COSINES:
                lights = "lights:\n" + lamp(side, alpha, cosine, SMALL)
                scene = write_scene(folder, material_text(template, alpha), cosine, lights)
                spp = max(args.samples // (SIDE * SIDE), 1)
                measured = Measurement(args, folder, ["walk", "two-walk", "auto"]).take(scene, spp, "mse")
                gains = [measured.gain(e) for e in ("auto", "two-walk")]
                cells += [cell(gains[0]), f"{gains[1][0]:.2f}"]
                worst.setdefault(name, []).append((gains[0][0], alpha, cosine))
            lines.append(f"| {name} | {alpha} | " + " | ".join(cells) + " |")
    summary = ["| material | least gain of auto | at α, cos | least at α ≥ 0.2 | at α, cos |", "|---|---|---|---|---|"]
    for name, rows in worst.items():
        low = min(rows)
        rough = min(row for row in rows if row[1] >= 0.2)
        summary.append(f"| {name} | {low[0]:.2f} | {low[1]}, {low[2]} | {rough[0]:.2f} | {rough[1]}, {rough[2]} |")
    return summary, lines


def elsewhere(args, folder):
    """The same materials under other lights."""
    lines = ["| material | α | lights | auto | two-walk |", "|---|---|---|---|---|"]
    spp = max(args.samples // (SIDE * SIDE), 1)
    for name, template, side in MATERIALS:
        print(f"{name}, elsewhere …", file=sys.stderr, flush=True)
        for alpha in (0.1, 0.7):
            for what, lights in (
                ("constant world", "world: {constant: {color: 1}}"),
                ("large lamp", "lights:\n" + lamp(side, alpha, 0.5, LARGE)),
            ):
                scene = write_scene(folder, material_text(template, alpha), 0.5, lights)
                measured = Measurement(args, folder, ["walk", "two-walk", "auto"]).take(scene, spp, "mse")
                lines.append(f"| {name} | {alpha} | {what} | {cell(measured.gain('auto'))} "
                             f"| {cell(measured.gain('two-walk'))} |")
    return lines


def whole_scenes(args, folder):
    """Whole scenes, by the relative error of their images."""
    lines = ["| scene | auto | two-walk |", "|---|---|---|"]
    for name in SCENES:
        print(f"{name} …", file=sys.stderr, flush=True)
        scene = os.path.join(ROOT, "scenes", name, "scene.yaml")
        measured = Measurement(args, folder, ["walk", "two-walk", "auto"])
        measured.take(scene, SCENE_SPP.get(name, 8), "rel_mse_trimmed")
        lines.append(f"| {name} | {cell(measured.gain('auto'))} | {measured.gain('two-walk')[0]:.2f} |")
    return lines


def main():
    """Parse, measure, write."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--smithwalk", default=os.path.join(ROOT, "target", "release", "smithwalk"))
    parser.add_argument("--samples", type=int, default=1 << 18, help="of an image of the square")
    parser.add_argument("--repeats", type=int, default=3, help="pairs of seeds for each estimator")
    parser.add_argument("--only", choices=("small", "elsewhere", "scenes"), help="this part alone")
    args = parser.parse_args()
    said = (f"{args.repeats} repeats of two seeds, {args.samples} samples an image; "
            "`benches/estimators.py` writes this section.")
    with tempfile.TemporaryDirectory() as folder:
        write_square(folder)
        if args.only in (None, "small"):
            summary, lines = small_lamp(args, folder)
            text = "\n".join([
                f"A square, one lamp of half angle {SMALL}°, off the mirrored (or refracted) direction by about",
                f"the width of the lobe (atan α, at most {FURTHEST}°). Variance × CPU time of the plain walk over that of `auto`, with the range over the",
                f"repeats, and over that of `two-walk`. {said}", "", *summary, "", *lines])
            section.replace("Under a small lamp", text, PAGE, TITLE)
            print(text + "\n")
        if args.only in (None, "elsewhere"):
            text = "\n".join([
                f"The same under a constant world alone, and under a lamp of half angle {LARGE}°; cos 0.5. {said}",
                "", *elsewhere(args, folder)])
            section.replace("Under other lights", text, PAGE, TITLE)
            print(text + "\n")
        if args.only in (None, "scenes"):
            text = "\n".join([
                "Whole scenes, one path a sample: relMSE (ε = 0.01, the worst 0.1 % of the pixels left out)",
                f"between two seeds × CPU time, walk over `auto` and over `two-walk`. {args.repeats} repeats.",
                "`benches/estimators.py` writes this section.", "", *whole_scenes(args, folder)])
            section.replace("Whole scenes", text, PAGE, TITLE)
            print(text)


if __name__ == "__main__":
    main()
