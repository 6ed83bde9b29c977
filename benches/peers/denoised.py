#!/usr/bin/env python3
"""FLIP against CPU time, noisy and by Open Image Denoise, here and in Cycles.

    python3 benches/peers/denoised.py -o DIR [--scenes NAME,...] [--bpy [PYTHON=]DIR]...

Both denoise with albedo and normal as guides. FLIP is that of `smithwalk diff`, the
mean over the pixels, against the renderer's own image of `--reference-spp` samples,
which is denoised too, since its noise would else count as everyone's error. CPU
seconds are those of rendering and denoising, less those of a render of a few pixels.
Mitsuba has no part in it: its denoiser is OptiX', for graphics cards; Debian builds
Blender 3.4 without one. Prints a table; with --docs it becomes a section of
docs/benchmarks.md.
"""

import argparse
import json
import os
import re
import sys

from contenders import Smithwalk, add_options, cycles, smithwalks
import section
from big_mesh import measure
from command import run


def ours(contender, jobs):
    """CPU seconds of each job; those to be denoised are written beside OUT as OUT.denoised.exr."""
    def seconds(job, *more):
        return measure(contender.command(job, *more, *(["--denoise"] if job.get("denoise") else [])))[1]

    few = ("-D", "film.width=8", "-D", "film.height=6")
    found = []
    for job in jobs:
        before = seconds({**job, "spp": 1, "out": job["out"] + ".few.exr"}, *few)
        found.append(seconds(job) - before)
    return found


def rows(args, scene, contender, folder):
    """(spp, CPU s and FLIP noisy, the same denoised) at each number of samples; and the version."""
    os.makedirs(folder, exist_ok=True)
    mine = isinstance(contender, Smithwalk)

    def job(name, spp, seed, denoise):
        return {"spp": spp, "seed": seed, "denoise": denoise, "out": os.path.join(folder, name + ".exr")}

    reference = job("reference", args.reference_spp * contender.factor, 1001, True)
    samples = args.spp if mine else [*args.spp, 4 * args.spp[-1]]
    noisy = [job(f"noisy-{spp}", spp, 7, False) for spp in samples]
    denoised = [job(f"denoised-{spp}", spp, 7, True) for spp in samples]
    if mine:
        ours(contender, [reference])
        times = [ours(contender, jobs) for jobs in (noisy, denoised)]
        version = run([args.smithwalk, "--version"]).strip()
    else:
        # Those to be denoised by themselves: the hand-over differs.
        version, first = contender.render(noisy, folder)
        _, second = contender.render(denoised + [reference], folder)
        times = [[result["cpu_s"] for result in results] for results in (first, second)]

    def file(job):
        return re.sub(r"exr$", "denoised.exr", job["out"]) if mine and job["denoise"] else job["out"]

    def flip(job):
        return json.loads(run([args.smithwalk, "diff", file(job), file(reference), "--json"]))["flip"]
    return version, [(a["spp"], s, flip(a), t, flip(b)) for a, b, s, t in zip(noisy, denoised, *times)]


def main():
    """Parse, render, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add_options(parser)
    parser.add_argument("--spp", default="1,4,16", help="samples per pixel, comma-separated")
    parser.add_argument("--reference-spp", type=int, default=64, help="this renderer's; Cycles takes 4 ×")
    args = parser.parse_args()
    args.spp = [int(n) for n in args.spp.split(",")]
    args.output = os.path.abspath(args.output)
    os.makedirs(args.output, exist_ok=True)
    lines = ["| scene | | spp | CPU s, noisy | FLIP, noisy | CPU s, denoised | FLIP, denoised |", "|---" * 7 + "|"]
    for scene in args.scenes.split(","):
        able = smithwalks(args, scene)[:1] + [
            one for one in cycles(args, scene)[0] if not re.search("3.4|guided", one.name)]
        for contender in able:
            if not re.search(args.only, contender.name):
                continue
            folder = os.path.join(args.output, scene, re.sub(r"\W+", "-", contender.name))
            version, found = rows(args, scene, contender, folder)
            for spp, noisy_s, noisy, denoised_s, denoised in found:
                lines.append(f"| {scene} | {version} | {spp} | {noisy_s:.2f} | {noisy:.3f} | {denoised_s:.2f} "
                             f"| {denoised:.3f} |")
                print(lines[-1], file=sys.stderr, flush=True)
    text = f"""\
One image each at {args.percent} % of the scenes' sizes, one run of `benches/peers/denoised.py`: FLIP,
the mean over the pixels, against the renderer's own image of {args.reference_spp} samples
(Cycles: {4 * args.reference_spp}), which is denoised too; CPU seconds of rendering and denoising, less those of a
few pixels. `auto` here, Multiscatter GGX in Cycles; both denoise by Open Image Denoise with albedo and normal. Mitsuba's denoiser is
OptiX', which needs a graphics card, and Debian's Blender 3.4 has none.

""" + "\n".join(lines)
    if args.docs:
        section.replace("Denoised", text)
    print(text)


if __name__ == "__main__":
    main()
