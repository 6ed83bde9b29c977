#!/usr/bin/env python3
"""Layers scaled by albedos against light that walks among them: albedos, lobes, cost.

    benches/layers.py [--binary FILE] [--cycles MEASURED.csv]... [--samples N] [--spp N]

Writes sections of docs/layers.md. MEASURED.csv is what blender/measure_principled.py wrote
of a Cycles; its materials are compared.
"""

import argparse
import csv
import json
import os
import re
import sys
import tempfile

import section
from command import run

ROOT = os.path.normpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
PAGE = os.path.join(ROOT, "docs", "layers.md")
TITLE = "# Layers by walks and by albedos\n"
COSINES = ("0.9", "0.5", "0.2")

# Directions towards the light for a viewer at 45° in the xz-plane.
VIEW = "0.70711,0,0.70711"
LIGHTS = (("mirrored", "-0.70711,0,0.70711"), ("along the normal", "0,0,1"),
          ("back to the viewer", "0.70711,0,0.70711"), ("grazing, mirrored", "-0.98,0,0.19900"))

# What is rendered for the cost: on the sphere of scenes/gold_sphere.
COST = (
    ("plastic", "principled: {{version: 5.0, layering: {0}, base_color: [0.5, 0.1, 0.05], roughness: 0.3}}"),
    ("coat over metal", "principled: {{version: 5.0, layering: {0}, base_color: [0.9, 0.6, 0.3], metallic: 1, "
                        "roughness: 0.4, coat_weight: 1}}"),
    ("coat over plastic", "principled: {{version: 5.0, layering: {0}, base_color: [0.5, 0.1, 0.05], roughness: 0.5, "
                          "coat_weight: 1}}"),
)


def material(said, layering, version="5.0"):
    """The node with these sockets."""
    return f"principled: {{version: {version}, layering: {layering}, {said}}}"


class Command:
    """The smithwalk command."""

    def __init__(self, binary):
        self.binary = binary

    def albedo(self, yaml, samples):
        """Directional albedo and its standard error at COSINES."""
        text = run([self.binary, "bsdf", "albedo", "--material", yaml, "--cos", ",".join(COSINES),
                    "--samples", str(samples), "--json"])
        return [(row["r"][0], row["r_se"][0]) for row in json.loads(text)]

    def value(self, yaml, light, samples):
        """f·cosθ and its standard error."""
        text = run([self.binary, "bsdf", "eval", "--material", yaml, "--wo", VIEW, f"--wi={light}",
                    "--samples", str(samples), "--json"])
        found = json.loads(text)
        return found["value"][0], found["se"][0]

    def cost(self, yaml, spp, folder):
        """CPU seconds of a render, the least of three, and the relMSE of its noise but for the worst 0.1 % of pixels."""
        images, seconds = [], 0.0
        for seed in (1, 2):
            images.append(os.path.join(folder, f"{seed}.exr"))
            said = [run([self.binary, "render", os.path.join(ROOT, "scenes", "gold_sphere", "scene.yaml"),
                         "-o", images[-1], "--spp", str(spp), "-D", "sampling.branches=1", "--seed", str(seed),
                         "-D", f"materials.gold={{{yaml}}}"]) for _ in range(3)]
            seconds += min(float(re.search(r"\(([\d.]+) s CPU\)", text)[1]) for text in said) / 2
        text = run([self.binary, "diff", *images, "--json"])
        return seconds, json.loads(text)["rel_mse_trimmed"] / 2


def read(path):
    """What a Cycles measured: its name, and rows by material and cosine."""
    with open(path, encoding="utf-8") as file:
        name = re.search(r"Blender ([\d.]+)", file.readline())[1]
        rows = {(row["material"], row["cos"]): (float(row["albedo"]), float(row["albedo_se"]))
                for row in csv.DictReader(file)}
    return name, rows


def percent(value, reference):
    """How far one figure is from another."""
    return f"{100 * (value / reference - 1):+.1f} %"


def albedos(command, cycles, samples):
    """The table of albedos."""
    names = [f"Cycles {name}" for name, _ in cycles]
    lines = [f"| principled | cosθ | walks | {' | '.join(names)} | `layering: cycles` | "
             f"{' | '.join(f'{n}, off' for n in names)} | `cycles`, off |",
             "|---" * (4 + 2 * len(names) + 1) + "|"]
    for said in dict.fromkeys(said for said, _ in cycles[0][1]):
        walks = command.albedo(material(said, "walks"), samples)
        scaled = command.albedo(material(said, "cycles"), samples)
        for k, cos in enumerate(COSINES):
            found = [rows[(said, cos)][0] for _, rows in cycles]
            lines.append(
                f"| {said} | {cos} | {walks[k][0]:.4f} | " + " | ".join(f"{f:.4f}" for f in found)
                + f" | {scaled[k][0]:.4f} | " + " | ".join(percent(f, walks[k][0]) for f in found)
                + f" | {percent(scaled[k][0], walks[k][0])} |")
    return "\n".join(lines)


def lobes(command, samples):
    """The table of lobes."""
    lines = ["| principled | light from | walks, sr⁻¹ | `layering: cycles`, sr⁻¹ | off |", "|---|---|---|---|---|"]
    for said in ("base_color: 0.02, roughness: 0.3", "base_color: 0.8, roughness: 0.3", "base_color: 0.8, roughness: 1",
                 "base_color: 0.8, metallic: 1, roughness: 0.4, coat_weight: 1, coat_roughness: 0.3"):
        for name, light in LIGHTS:
            walks, walks_se = command.value(material(said, "walks"), light, samples)
            scaled, scaled_se = command.value(material(said, "cycles"), light, samples)
            lines.append(f"| {said} | {name} | {walks:.4f} ± {walks_se:.4f} | {scaled:.4f} ± {scaled_se:.4f} | "
                         f"{percent(scaled, walks)} |")
    return "\n".join(lines)


def cost(command, spp):
    """The table of costs."""
    lines = ["| sphere of | CPU s, `cycles` | relMSE, `cycles` | CPU s, walks | relMSE, walks | "
             "CPU time to equal error, walks over `cycles` |", "|---|---|---|---|---|---|"]
    with tempfile.TemporaryDirectory() as folder:
        for name, yaml in COST:
            (a, noise_a), (b, noise_b) = (command.cost(yaml.format(layering), spp, folder)
                                          for layering in ("cycles", "walks"))
            lines.append(f"| {name} | {a:.2f} | {noise_a:.2e} | {b:.2f} | {noise_b:.2e} | "
                         f"{b * noise_b / (a * noise_a):.1f} |")
    return "\n".join(lines)


def main():
    """Measure and write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--binary", default=os.path.join(ROOT, "target", "release", "smithwalk"))
    parser.add_argument("--cycles", action="append", default=[])
    parser.add_argument("--samples", type=int, default=100_000)
    parser.add_argument("--spp", type=int, default=8)
    args = parser.parse_args()
    if not args.cycles:
        sys.exit("expected --cycles FILE, from blender/measure_principled.py")
    command = Command(args.binary)
    cycles = [read(path) for path in args.cycles]
    section.replace("Albedos", f"Of {args.samples} walks each; standard errors are below 0.001. \"Off\" is against the "
                    f"walks.\n\n{albedos(command, cycles, args.samples)}", PAGE, TITLE)
    section.replace("Lobes", "f·cosθ towards the viewer at 45°, with light from four directions.\n\n"
                    + lobes(command, 2 * args.samples), PAGE, TITLE)
    section.replace("Cost", f"The sphere of `scenes/gold_sphere` at {args.spp} samples per pixel and one branch; CPU times "
                    "are the least of three, relMSE is that of the noise, half of what two seeds differ by, the worst "
                    f"0.1 % of the pixels left out.\n\n{cost(command, args.spp)}", PAGE, TITLE)


if __name__ == "__main__":
    main()
