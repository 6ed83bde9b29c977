"""Who takes part in a race: renderers behind one way of asking for images.

A contender renders a list of jobs {spp, seed, out}; what else is asked of it it
adds to each: `percent` of the scene's size, and for Cycles `guided` and `denoise`.
"""

import glob
import json
import os
import re
import shutil
import subprocess
import sys

ROOT = os.path.normpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", ".."))
HERE = os.path.join(ROOT, "benches", "peers")
BOUNCES = 12  # in all of the scenes
SCENES = ("gold_sphere", "interior", "rough_glass", "brushed_metal", "product_shot", "daylight_room", "many_lamps")

sys.path.insert(0, os.path.dirname(HERE))
from command import run  # noqa: E402


class Worker:
    """A renderer behind a process that takes a list of jobs.

    It takes `factor` × as many samples as this renderer, `more` goes into every job,
    and `like` names the contender that converges to the same image.
    """

    def __init__(self, name, command, factor=1, more=None, like=None, **environment):
        self.name, self.command, self.environment = name, command, environment
        self.factor, self.more, self.like = factor, more or {}, like or name

    def render(self, jobs, folder):
        """Render all jobs; returns version and times."""
        job_file, result_file = (os.path.join(folder, n) for n in ("jobs.json", "results.json"))
        with open(job_file, "w", encoding="utf-8") as file:
            json.dump([{**job, **self.more} for job in jobs], file)
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

    factor = 1

    def __init__(self, name, binary, scene, *arguments):
        self.name, self.binary, self.scene, self.arguments = f"smithwalk {name}", binary, scene, arguments
        self.like = self.name

    def render(self, jobs, _folder):
        """Render all jobs; returns version and times."""
        times = []
        for job in jobs:
            text = run(self.command(job))
            found = re.search(r"spp in ([\d.]+) s \(([\d.]+) s CPU\)", text)
            times.append({"wall_s": float(found[1]), "cpu_s": float(found[2])})
        return run([self.binary, "--version"]).strip(), times

    def command(self, job, *more):
        """What renders a job."""
        return [self.binary, "render", self.scene, "-o", job["out"], "--spp", str(job["spp"]), "--seed", str(job["seed"]),
                *self.arguments, *more]


def scaled(path, percent):
    """Options that render a scene at so many percent of its size."""
    with open(path, encoding="utf-8") as file:
        text = file.read()
    sides = {side: int(re.search(rf"^  {side}: (\d+)", text, re.MULTILINE)[1]) for side in ("width", "height")}
    return [word for side, pixels in sides.items() for word in ("-D", f"film.{side}={pixels * percent // 100}")]


def smithwalks(args, scene):
    """This renderer with each of its estimators."""
    path = os.path.join(ROOT, "scenes", scene, "scene.yaml")
    return [Smithwalk(estimator, args.smithwalk, path, "--estimator", estimator, *scaled(path, args.percent))
            for estimator in ("auto", "single", "compensated")]


def cycles(args, scene):
    """Every Cycles at hand, with and without path guiding; and what is missing.

    Each Blender builds the scene with the script that made it.
    """
    able, missing = [], []
    script = os.path.join(ROOT, "blender", "scenes", scene + ".py")
    worker = os.path.join(HERE, "cycles_worker.py")

    def add(version, distributions, before, build, **environment):
        blend = os.path.join(args.output, f"{scene}-{version}.blend")
        if not os.path.exists(blend):
            run([*build, blend], **environment)
            if not os.path.exists(blend):
                sys.exit(f"Blender {version} made no {blend}")
        for label, distribution in distributions:
            name = f"Cycles {version} {label}"

            def command(jobs, results, d=distribution):
                return [*before(blend), jobs, results, d, str(BOUNCES)]
            able.append(Worker(name, command, 4, {"percent": args.percent}, **environment))
        if version != "3.4":
            able.append(Worker(f"{name}, guided", command, 4, {"percent": args.percent, "guided": True}, name,
                               **environment))

    blender = shutil.which("blender")
    if blender:
        # Debian's Blender takes its numpy from the first python3 on the path,
        # which may be another one that runs this script.
        add("3.4", (("GGX", "GGX"), ("Multiscatter GGX", "MULTI_GGX")),
            lambda blend: [blender, "-b", blend, "--python", worker, "--"],
            [blender, "-b", "--factory-startup", "--python", script, "--"], PATH=os.defpath)
        missing.append("path guiding in Cycles 3.4, which Debian builds without it")
    else:
        missing.append("Cycles 3.4: no `blender` on the path")
    for option in args.bpy or ():
        python, _, folder = option.rpartition("=")
        python = python or sys.executable
        found = glob.glob(os.path.join(folder, "bpy-*.dist-info"))
        if not found:
            sys.exit(f"--bpy {option}: no bpy module is installed there")
        version = ".".join(re.findall(r"\d+", os.path.basename(found[0]))[:2])
        add(version, (("Multiscatter GGX", "MULTI_GGX"),), lambda blend, python=python: [python, worker, blend],
            [python, script], PYTHONPATH=folder)
    if not args.bpy:
        missing.append("newer Cycles: --bpy is not given")
    return able, missing


def importable(module, environment):
    """Whether a worker would find a Python module."""
    return not subprocess.run([sys.executable, "-c", f"import {module}"], capture_output=True,
                              env={**os.environ, **environment}, check=False).returncode


def others(args, scene):
    """Mitsuba and LuxCore; and what is missing."""
    able, missing = [], []
    folder = os.path.join(ROOT, "scenes", scene)
    path = {"PYTHONPATH": args.mitsuba} if args.mitsuba else {}
    variants = [("scalar_rgb", "independent", 4)]
    if args.llvm:
        path["DRJIT_LIBLLVM_PATH"] = args.llvm
        variants.append(("llvm_ad_rgb", "multijitter", 16))
    else:
        missing.append("Mitsuba llvm_ad_rgb: --llvm is not given")
    if importable("mitsuba", path):
        for variant, sampler, factor in variants:
            able.append(Worker(
                f"Mitsuba 3 {variant} GGX",
                lambda jobs, results, v=variant, s=sampler: [
                    sys.executable, os.path.join(HERE, "mitsuba_worker.py"), folder, jobs, results, v, s],
                factor, {"percent": args.percent}, **path))
    else:
        missing.append("Mitsuba: the module can't be imported; try --mitsuba")
    path = {"PYTHONPATH": args.luxcore} if args.luxcore else {}
    if importable("pyluxcore", path):
        able.append(Worker(
            "LuxCore 2 PATHCPU",
            lambda jobs, results: [sys.executable, os.path.join(HERE, "luxcore_worker.py"), folder, jobs, results],
            4, {"percent": args.percent}, **path))
    else:
        missing.append("LuxCore: the module can't be imported; try --luxcore")
    return able, missing


def contenders(args, scene):
    """Everyone who can take part in a scene, and who can't."""
    theirs, missing = cycles(args, scene)
    rest, more = others(args, scene)
    return smithwalks(args, scene) + theirs + rest, missing + more


def add_options(parser):
    """What a script must be told about renderers and scenes."""
    parser.add_argument("-o", "--output", required=True, help="folder for images and tables")
    parser.add_argument("--smithwalk", default=os.path.join(ROOT, "target", "release", "smithwalk"))
    parser.add_argument("--scenes", default=",".join(SCENES), help="comma-separated folders of scenes/")
    parser.add_argument("--percent", type=int, default=100, help="of the scenes' sizes")
    parser.add_argument("--bpy", action="append", metavar="[PYTHON=]DIR",
                        help="PYTHONPATH of a bpy module, with its numpy, and the Python that it is for; may be given "
                             "several times")
    parser.add_argument("--mitsuba", help="folder with the mitsuba module, if not installed")
    parser.add_argument("--llvm", help="libLLVM.so for Mitsuba's llvm variant")
    parser.add_argument("--luxcore", help="folder with the pyluxcore module, if not installed")
    parser.add_argument("--only", default="", help="regular expression: names of those who take part")
    parser.add_argument("--docs", action="store_true", help="write the section of docs/benchmarks.md")
