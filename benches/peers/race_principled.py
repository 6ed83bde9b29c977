#!/usr/bin/env python3
"""Races layers against Cycles' Principled node: spheres under a sky with a sun, in one run.

    python3 benches/peers/race_principled.py -o DIR --bpy DIR [--spheres NAME,...] [--smithwalk FILE] [--docs]

Error and efficiency are those of race.py. One thread for everyone, CPU seconds. The scenes are
those of blender/scenes/principled_spheres.py, as the exporter writes them; `openpbr` stands beside
the node that is nearest to it. With --docs the table becomes a section of docs/layers.md.
"""

import argparse
import os
import statistics
import sys

import race

sys.path.insert(0, os.path.join(race.ROOT, "benches"))
import section  # noqa: E402
from command import run  # noqa: E402

BOUNCES = 8
OPENPBR = ("{openpbr: {base_color: [0.5, 0.1, 0.05], specular_roughness: 0.5, coat_weight: 1, "
           "coat_roughness: 0.1}}")
SPHERES = ("plastic", "coat_over_metal", "coat_over_plastic")


def ours(args, scene):
    """This renderer's ways, of which the first is Cycles' own."""
    path = os.path.join(args.output, scene, "scene.yaml")
    ways = [("`cycles`, compensated", ("--estimator", "compensated")),
            ("walks", ("-D", "materials.ball.principled.layering=walks"))]
    if scene == "coat_over_plastic":
        ways.append(("openpbr", ("-D", f"materials.ball={OPENPBR}")))
    return [race.Smithwalk(name, args.smithwalk, path, "--threads", "1", *more) for name, more in ways]


def cycles(args, scene):
    """Cycles of the bpy module."""
    worker = os.path.join(race.HERE, "cycles_worker.py")
    blend = os.path.join(args.output, scene + ".blend")
    return race.Worker(
        "Cycles",
        lambda jobs, results: [sys.executable, worker, blend, jobs, results, "MULTI_GGX", str(BOUNCES)],
        PYTHONPATH=args.bpy)


def main():
    """Build, race, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", required=True, help="folder for scenes and images")
    parser.add_argument("--smithwalk", default=os.path.join(race.ROOT, "target", "release", "smithwalk"))
    parser.add_argument("--bpy", required=True, help="PYTHONPATH of the bpy module, 5.0")
    parser.add_argument("--spheres", default=",".join(SPHERES), help="comma-separated")
    parser.add_argument("--side", type=int, default=64, help="of images, in pixels")
    parser.add_argument("--spp", type=int, default=96)
    parser.add_argument("--reference-spp", type=int, default=192, help="of each of the two")
    parser.add_argument("--seeds", type=int, default=3, help="images to average over")
    parser.add_argument("--docs", action="store_true", help="write the section of docs/layers.md")
    args = parser.parse_args()
    args.spp, args.output = [args.spp], os.path.abspath(args.output)
    run([sys.executable, os.path.join(race.ROOT, "blender", "scenes", "principled_spheres.py"), args.output,
         str(args.side)],
        PYTHONPATH=args.bpy)

    lines = ["| sphere of | renderer | CPU s | relMSE | relMSE × CPU s | spread | Cycles over this |", "|---" * 7 + "|"]
    version = ""
    for scene in args.spheres.split(","):
        costs = {}
        for contender in (cycles(args, scene), *ours(args, scene)):
            said, rows = race.race(args, scene, contender)
            version = said if contender.name == "Cycles" else version
            seconds, errors = ([row[key] for row in rows] for key in ("cpu_s", "rel_mse"))
            found = [race.cost(row) for row in rows]
            costs[contender.name] = statistics.fmean(found)
            lines.append(
                f"| {scene.replace('_', ' ')} | {contender.name} | {statistics.fmean(seconds):.2f} "
                f"| {statistics.fmean(errors):.2e} | {costs[contender.name]:.2e} "
                f"| ± {100 * statistics.stdev(found) / costs[contender.name]:.0f} % "
                f"| {costs['Cycles'] / costs[contender.name]:.2f} |")
            print(lines[-1], flush=True)
    text = (f"Each against converged images of its own, one run of `benches/peers/race_principled.py`: {args.seeds} "
            f"images of {args.side} × {args.side} at {args.spp[0]} samples per pixel, one thread, Cycles of {version}. The last column is "
            "Cycles' CPU time to equal error over that of the row; above 1 this renderer leads.\n\n" + "\n".join(lines))
    if args.docs:
        section.replace("Beside Cycles' Principled", text, os.path.join(race.ROOT, "docs", "layers.md"),
                        "# Layers by walks and by albedos\n")


if __name__ == "__main__":
    main()
