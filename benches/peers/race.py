#!/usr/bin/env python3
"""Races smithwalk against Cycles and Mitsuba 3 over a few scenes, in one run.

    python3 benches/peers/race.py -o DIR [--scenes NAME,...] [--bpy DIR] [--mitsuba DIR] [--llvm LIB]

Every renderer is held against its own converged images, so that differences
between models do not count, noise alone. Two long renders A and B with seeds of
their own are the reference: the error of an image T is the mean of relMSE(T, A)
and relMSE(T, B) less relMSE(A, B)/2, which is what the noise of A and B adds.
Efficiency is relMSE × CPU seconds; less is better, and its ratio between two
renderers is that of their times at equal error. relMSE is that of `smithwalk
diff`: ε = 0.01, the worst 0.1 % of the pixels left out. The last columns are
from it too: values beyond 10 robust standard deviations of the image, and the
largest, against A or B, whichever has fewer, so that no firefly of theirs counts.

References that an earlier run left in DIR are kept, as their times do not count.

Writes for each scene race-SCENE.csv, one row for each image, which `smithwalk
converge --peer` reads, and race.md, the tables; with --docs the tables become a
section of docs/benchmarks.md. What is not installed is left out, and said so.
"""

import argparse
import csv
import json
import os
import re
import shutil
import statistics
import subprocess
import sys

ROOT = os.path.normpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", ".."))
HERE = os.path.join(ROOT, "benches", "peers")
BOUNCES = 12  # in all of the scenes
SCENES = ("gold_sphere", "interior", "rough_glass", "brushed_metal")

sys.path.insert(0, os.path.dirname(HERE))
import section  # noqa: E402
from command import run  # noqa: E402


class Worker:
    """A renderer behind a process that takes a list of jobs."""

    def __init__(self, name, command, **environment):
        self.name, self.command, self.environment = name, command, environment

    def render(self, jobs, folder):
        """Render all jobs; returns version and times."""
        job_file, result_file = (os.path.join(folder, n) for n in ("jobs.json", "results.json"))
        with open(job_file, "w", encoding="utf-8") as file:
            json.dump(jobs, file)
        if os.path.exists(result_file):
            os.remove(result_file)
        said = run(self.command(job_file, result_file), **self.environment)
        if not os.path.exists(result_file):
            sys.exit(f"{self.name} ended without results:\n{said}")
        with open(result_file, encoding="utf-8") as file:
            answer = json.load(file)
        return answer["version"], answer["results"]


class Smithwalk:
    """This renderer, one process for each image; the times are its own figures."""

    def __init__(self, name, binary, scene, *arguments):
        self.name, self.binary, self.scene, self.arguments = f"smithwalk {name}", binary, scene, arguments

    def render(self, jobs, _folder):
        """Render all jobs; returns version and times."""
        times = []
        for job in jobs:
            text = run([self.binary, "render", self.scene, "-o", job["out"],
                        "--spp", str(job["spp"]), "--seed", str(job["seed"]), *self.arguments])
            found = re.search(r"spp in ([\d.]+) s \(([\d.]+) s CPU\)", text)
            times.append({"wall_s": float(found[1]), "cpu_s": float(found[2])})
        return run([self.binary, "--version"]).strip(), times


def contenders(args, scene):
    """Everyone who can take part in a scene, and who can't."""
    able, missing = [], []
    path = os.path.join(ROOT, "scenes", scene, "scene.yaml")
    for estimator in ("auto", "single", "compensated"):
        able.append(Smithwalk(estimator, args.smithwalk, path, "--estimator", estimator))

    blend = os.path.join(args.output, scene + ".blend")
    cycles = os.path.join(HERE, "cycles_worker.py")
    blender = shutil.which("blender")
    if blender:
        # Debian's Blender takes its numpy from the first python3 on the path,
        # which may be another one that runs this script.
        system = {"PATH": os.defpath}
        run([blender, "-b", "--factory-startup", "--python",
             os.path.join(ROOT, "blender", "scenes", scene + ".py"), "--", blend], **system)
        if not os.path.exists(blend):
            sys.exit(f"blender made no {blend}")
        for label, distribution in (("GGX", "GGX"), ("Multiscatter GGX", "MULTI_GGX")):
            able.append(Worker(
                f"Cycles 3.4 {label}",
                lambda jobs, results, d=distribution: [
                    blender, "-b", blend, "--python", cycles, "--", jobs, results, d, str(BOUNCES)],
                **system))
    else:
        missing.append("Cycles 3.4: no `blender` on the path")
    if args.bpy and os.path.exists(blend):
        able.append(Worker(
            "Cycles 5.0 Multiscatter GGX",
            lambda jobs, results: [
                sys.executable, cycles, blend, jobs, results, "MULTI_GGX", str(BOUNCES)],
            PYTHONPATH=args.bpy))
    else:
        missing.append("Cycles 5.0: --bpy is not given, or there is no blender to make the scene")

    path = {"PYTHONPATH": args.mitsuba} if args.mitsuba else {}
    probe = subprocess.run([sys.executable, "-c", "import mitsuba"], capture_output=True,
                           env={**os.environ, **path}, check=False)
    variants = [("scalar_rgb", "independent")]
    if args.llvm:
        path["DRJIT_LIBLLVM_PATH"] = args.llvm
        variants.append(("llvm_ad_rgb", "multijitter"))
    else:
        missing.append("Mitsuba llvm_ad_rgb: --llvm is not given")
    if probe.returncode:
        missing.append("Mitsuba: the module can't be imported; try --mitsuba")
    else:
        for variant, sampler in variants:
            able.append(Worker(
                f"Mitsuba 3 {variant} GGX",
                lambda jobs, results, v=variant, s=sampler: [
                    sys.executable, os.path.join(HERE, "mitsuba_worker.py"),
                    os.path.join(ROOT, "scenes", scene), jobs, results, v, s],
                **path))
    return able, missing


def diff(args, image, reference):
    """The figures of `smithwalk diff`."""
    return json.loads(run([args.smithwalk, "diff", image, reference, "--json"]))


def race(args, scene, contender):
    """Reference and images of one renderer; its version and a row for each image."""
    folder = os.path.join(args.output, scene, re.sub(r"\W+", "-", contender.name))
    os.makedirs(folder, exist_ok=True)
    references = [{"spp": args.reference_spp, "seed": 101 + i,
                   "out": os.path.join(folder, f"reference-{args.reference_spp}-{i}.exr")}
                  for i in range(2)]
    images = [{"spp": spp, "seed": seed, "out": os.path.join(folder, f"{spp}-{seed}.exr")}
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
    return version, rows


def mean_of(rows, name, spp, value):
    """The mean over the seeds of `value(row)`, and all the values."""
    values = [value(row) for row in rows if row["name"] == name and row["spp"] == spp]
    return statistics.fmean(values), values


def cost(row):
    """relMSE × CPU s: the CPU seconds to a relMSE of 1."""
    return row["rel_mse"] * row["cpu_s"]


def table(args, scene, versions, rows):
    """Markdown: figures of one scene at the last number of samples, mean over the seeds."""
    spp = args.spp[-1]
    lines = [f"### {scene}", "",
             f"| at {spp} spp | version | wall s | CPU s | relative RMSE | relMSE × CPU s | spread "
             "| outliers per million | largest, σ |",
             "|---|---|---|---|---|---|---|---|---|"]
    for name, version in versions.items():
        wall, cpu, error, outliers = (mean_of(rows, name, spp, lambda row, k=key: row[k])[0] for key in (
            "wall_s", "cpu_s", "rel_mse", "outliers_per_million"))
        largest = max(mean_of(rows, name, spp, lambda row: row["largest_deviation"])[1])
        mean, costs = mean_of(rows, name, spp, cost)
        spread = statistics.stdev(costs) / abs(mean) if len(costs) > 1 else 0.0
        lines.append(f"| {name} | {version} | {wall:.2f} | {cpu:.2f} | {max(error, 0.0) ** 0.5:.4f} "
                     f"| {mean:.2e} | ± {100 * spread:.0f} % | {outliers:.0f} | {largest:.0f} |")
    return "\n".join(lines) + "\n\n"


def alike(name):
    """Our estimator that does what the peer does."""
    if name.startswith("Cycles 3.4 Multi"):
        return "smithwalk auto"
    return "smithwalk compensated" if "Multiscatter" in name else "smithwalk single"


def factors(args, raced):
    """Markdown: by what factor we lead (above 1) or trail (below 1) at equal error."""
    spp, scenes = args.spp[-1], list(raced)
    names = list(dict.fromkeys(name for versions, _ in raced.values() for name in versions))

    def factor(scene, name, ours):
        versions, rows = raced[scene]
        if name not in versions or ours not in versions:
            return "–"
        theirs, mine = (mean_of(rows, n, spp, cost)[0] for n in (name, ours))
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
    text = ("Every renderer against its own converged images, noise alone: relMSE (ε = 0.01, the worst\n"
            f"0.1 % of the pixels left out) × CPU seconds, {args.seeds} images each, {os.cpu_count()} threads, one run of\n"
            "`benches/peers/race.py`. GGX is single scattering; so is all that Mitsuba does. Multiscatter GGX\n"
            "is a random walk in Cycles 3.4 and a scaling of single scattering in 5.0. Times are of the\n"
            "render call, with the scene's hand-over in Cycles. Mitsuba's `roughconductor` takes no rotation\n"
            "of the tangent: its engine-turned steel (`brushed_metal`) is brushed along u, another picture;\n"
            "and it counts a glass colour once, not at every facet. Outliers are values (three to a pixel)\n"
            "beyond 10 robust standard deviations σ of the image's noise, see `smithwalk diff`.\n\n")
    text += factors(args, raced)
    for scene, (versions, rows) in raced.items():
        text += table(args, scene, versions, rows)
    for reason in missing:
        text += f"Left out: {reason}.\n"
    return text.rstrip() + "\n"


def main():
    """Parse, race, write."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", required=True, help="folder for images and tables")
    parser.add_argument("--smithwalk", default=os.path.join(ROOT, "target", "release", "smithwalk"))
    parser.add_argument("--scenes", default=",".join(SCENES), help="comma-separated folders of scenes/")
    parser.add_argument("--bpy", help="PYTHONPATH of the bpy module, version 5.0, with a numpy below 2")
    parser.add_argument("--mitsuba", help="folder with the mitsuba module, if not installed")
    parser.add_argument("--llvm", help="libLLVM.so for Mitsuba's llvm variant")
    parser.add_argument("--spp", default="16,64", help="samples per pixel, comma-separated")
    parser.add_argument("--reference-spp", type=int, default=512, help="of each of the two")
    parser.add_argument("--seeds", type=int, default=3, help="images to average over")
    parser.add_argument("--only", help="regular expression: names of those who take part")
    parser.add_argument("--docs", action="store_true", help="write the section of docs/benchmarks.md")
    args = parser.parse_args()
    args.spp = sorted(int(n) for n in args.spp.split(","))
    args.output = os.path.abspath(args.output)
    os.makedirs(args.output, exist_ok=True)

    raced, missing = {}, []
    for scene in args.scenes.split(","):
        able, missing = contenders(args, scene)
        versions, rows = {}, []
        for contender in able:
            if args.only and not re.search(args.only, contender.name):
                continue
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
