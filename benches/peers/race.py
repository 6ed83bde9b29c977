#!/usr/bin/env python3
"""Races smithwalk against Cycles, Mitsuba 3 and LuxCore over a few scenes, in one run.

    python3 benches/peers/race.py -o DIR [--scenes NAME,...] [--bpy [PYTHON=]DIR]... [--mitsuba DIR] [--llvm LIB]
        [--luxcore DIR]

Every renderer is held against its own converged images, so that differences
between models do not count, noise alone. Two long renders A and B with seeds of
their own are the reference: the error of an image T is the mean of relMSE(T, A)
and relMSE(T, B) less relMSE(A, B)/2, which is what the noise of A and B adds.
Efficiency is relMSE × CPU seconds; less is better, and its ratio between two
renderers is that of their times at equal error. relMSE is that of `smithwalk
diff`: ε = 0.01, the worst 0.1 % of the pixels left out. The last columns are
from it too: values beyond 10 robust standard deviations of the image, and the
largest, against A or B, whichever has fewer, so that no firefly of theirs counts.

Samples per pixel are this renderer's, which are worth many; the others take a
multiple (`factor` in contenders.py), so that all images take about as long.
What an earlier run left in DIR is kept, references and rows of renderers alike, so
that a race can be stopped and go on.

Writes for each scene race-SCENE.csv, one row for each image, which `smithwalk
converge --peer` reads, and race.md, the tables; with --docs the tables become a
section of docs/benchmarks.md. What is not installed is left out, and said so.
"""

import argparse
import csv
import json
import os
import re
import statistics
import sys

from contenders import HERE, ROOT, Smithwalk, Worker, add_options, contenders  # noqa: F401: for race_principled.py
import section
from command import run


def diff(args, image, reference):
    """The figures of `smithwalk diff`."""
    return json.loads(run([args.smithwalk, "diff", image, reference, "--json"]))


def race(args, scene, contender):
    """Reference and images of one renderer; its version and a row for each image."""
    folder, kept = (os.path.join(args.output, scene, re.sub(r"\W+", "-", name))
                    for name in (contender.name, contender.like))
    done = os.path.join(folder, "rows.json")
    if os.path.exists(done):
        with open(done, encoding="utf-8") as file:
            return json.load(file)
    for path in (folder, kept):
        os.makedirs(path, exist_ok=True)
    references = [{"spp": args.reference_spp * contender.factor, "seed": 101 + i,
                   "out": os.path.join(kept, f"reference-{args.reference_spp}-{i}.exr")}
                  for i in range(2)]
    images = [{"spp": spp * contender.factor, "seed": seed, "out": os.path.join(folder, f"{spp}-{seed}.exr")}
              for spp in args.spp for seed in range(1, args.seeds + 1)]
    wanted = [job for job in references if not os.path.exists(job["out"])]
    version, times = contender.render(wanted + images, folder)
    a, b = (job["out"] for job in references)
    floor = diff(args, a, b)["rel_mse_trimmed"] / 2
    rows = []
    for job, time in zip(images, times[len(wanted):]):
        to_a, to_b = (diff(args, job["out"], reference) for reference in (a, b))
        error = (to_a["rel_mse_trimmed"] + to_b["rel_mse_trimmed"]) / 2 - floor
        values = 3 * to_a["width"] * to_a["height"]
        rows.append({"name": contender.name, "spp": job["spp"], "seed": job["seed"],
                     **time, "rel_mse": error, "floor": floor,
                     "outliers_per_million": 1e6 * min(to_a["outliers"], to_b["outliers"]) / values,
                     "largest_deviation": min(to_a["largest_deviation"], to_b["largest_deviation"])})
    with open(done, "w", encoding="utf-8") as file:
        json.dump([version, rows], file)
    return version, rows


def mean_of(rows, name, value):
    """The mean over the seeds of `value(row)` at the most samples, and all the values."""
    spp = max(row["spp"] for row in rows if row["name"] == name)
    values = [value(row) for row in rows if row["name"] == name and row["spp"] == spp]
    return statistics.fmean(values), values


def cost(row):
    """relMSE × CPU s: the CPU seconds to a relMSE of 1."""
    return row["rel_mse"] * row["cpu_s"]


def table(scene, versions, rows):
    """Markdown: figures of one scene at the most samples, mean over the seeds."""
    lines = [f"### {scene}", "",
             "| | version | spp | CPU s | relative RMSE | relMSE × CPU s | spread "
             "| outliers per million | largest, σ |",
             "|---" * 9 + "|"]
    for name, version in versions.items():
        spp, cpu, error, outliers = (mean_of(rows, name, lambda row, k=key: row[k])[0] for key in (
            "spp", "cpu_s", "rel_mse", "outliers_per_million"))
        largest = max(mean_of(rows, name, lambda row: row["largest_deviation"])[1])
        mean, costs = mean_of(rows, name, cost)
        spread = statistics.stdev(costs) / abs(mean) if len(costs) > 1 else 0.0
        lines.append(f"| {name} | {version} | {spp:.0f} | {cpu:.2f} | {max(error, 0.0) ** 0.5:.4f} "
                     f"| {mean:.2e} | ± {100 * spread:.0f} % | {outliers:.0f} | {largest:.0f} |")
    return "\n".join(lines) + "\n\n"


def alike(name):
    """Our estimator that does what the peer does."""
    if name.startswith("Cycles 3.4 Multi"):
        return "smithwalk auto"
    return "smithwalk compensated" if "Multiscatter" in name else "smithwalk single"


def factors(raced):
    """Markdown: by what factor we lead (above 1) or trail (below 1) at equal error."""
    scenes = list(raced)
    names = list(dict.fromkeys(name for versions, _ in raced.values() for name in versions))

    def factor(scene, name, ours):
        versions, rows = raced[scene]
        if name not in versions or ours not in versions:
            return "–"
        theirs, mine = (mean_of(rows, n, cost)[0] for n in (name, ours))
        return f"{theirs / mine:.2f}" if theirs > 0.0 and mine > 0.0 else "–"

    text = ""
    for title, ours in (
        ("CPU time to equal error, over that of all orders (`auto`); above 1 we lead", None),
        ("Over that of our estimator of the same kind", alike),
    ):
        lines = [title + ":", "", "| | " + ("ours | " if ours else "") + " | ".join(scenes) + " |",
                 "|---" * (len(scenes) + 1 + bool(ours)) + "|"]
        for name in names:
            if name.startswith("smithwalk"):
                continue
            own = ours(name) if ours else "smithwalk auto"
            cells = [factor(scene, name, own) for scene in scenes]
            lines.append("| " + " | ".join([name] + ([own.split()[1]] if ours else []) + cells) + " |")
        text += "\n".join(lines) + "\n\n"
    return text


def page(args, raced, missing):
    """The tables and what they mean."""
    text = f"""\
Every renderer against its own converged images, noise alone: relMSE (ε = 0.01, the worst
0.1 % of the pixels left out) × CPU seconds, {args.seeds} images each at {args.percent} % of the scenes'
sizes, {os.cpu_count()} threads, one run of
`benches/peers/race.py`: the ratios of CPU times count. Samples are such that images take about
as long; {args.reference_spp / args.spp[-1]:g} × as many make each of the two references, whose noise is taken off. Times are
of rendering alone: those of the scene's hand-over, which a render of a few pixels tells, are
taken off Cycles' and LuxCore's.

GGX is single scattering; so is all that Mitsuba and LuxCore do. Multiscatter GGX is a random
walk in Cycles 3.4 and a scaling of single scattering in newer ones. Cycles has its light tree,
as its settings come; *guided* is its path guiding, which learns as it samples. Mitsuba and
LuxCore render other pictures in part: no rotation of the tangent (the engine-turned steel of
`brushed_metal` is brushed one way), glass colours once and not at every facet, Disney's material
for Blender's Principled node, a pane of two faces for one (in Mitsuba by `volpath`, which alone
lets light through it); in LuxCore lamps are found by light samples alone. Outliers are values
(three to a pixel) beyond 10 robust standard deviations σ of the image's noise, see
`smithwalk diff`.

"""
    text += factors(raced)
    for scene, (versions, rows) in raced.items():
        text += table(scene, versions, rows)
    for reason in dict.fromkeys(missing):
        text += f"Left out: {reason}.\n"
    return text.rstrip() + "\n"


def main():
    """Parse, race, write."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    add_options(parser)
    parser.add_argument("--spp", default="16", help="this renderer's samples per pixel, comma-separated")
    parser.add_argument("--reference-spp", type=int, default=64, help="of each of the two")
    parser.add_argument("--seeds", type=int, default=3, help="images to average over")
    args = parser.parse_args()
    args.spp = sorted(int(n) for n in args.spp.split(","))
    args.output = os.path.abspath(args.output)
    os.makedirs(args.output, exist_ok=True)

    raced, missing = {}, []
    for scene in args.scenes.split(","):
        able, missing = contenders(args, scene)
        versions, rows = {}, []
        for contender in (one for one in able if re.search(args.only, one.name)):
            print(f"{scene}: {contender.name} …", file=sys.stderr, flush=True)
            versions[contender.name], more = race(args, scene, contender)
            rows += more
            # After everyone, so that a late failure loses nothing.
            path = os.path.join(args.output, f"race-{scene}.csv")
            with open(path, "w", encoding="utf-8", newline="") as file:
                writer = csv.DictWriter(file, fieldnames=list(rows[0]))
                writer.writeheader()
                writer.writerows(rows)
        if not rows:
            sys.exit(f"{scene}: nobody takes part")
        raced[scene] = versions, rows
    text = page(args, raced, missing)
    with open(os.path.join(args.output, "race.md"), "w", encoding="utf-8") as file:
        file.write(text)
    if args.docs:
        section.replace("Beside other renderers", text)
    print(text, end="")


if __name__ == "__main__":
    main()
