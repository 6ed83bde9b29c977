#!/usr/bin/env python3
"""Times a million evaluations in Python, in Rust, and of single scattering in Mitsuba 3.

    cargo build --release -p smithwalk-validation --example million
    pip install ./python mitsuba
    python3 benches/python_speed.py --million target/release/examples/million

Gold GGX of α 0.5, a million pairs of directions, one estimate of all orders each, by the same
estimator and on all cores in Python and in Rust. Times are CPU seconds of all threads, the mean
of ten runs after the first; rounds of either take turns, and the least round counts. Mitsuba's
`roughconductor` evaluates the first order in closed form, compiled beforehand; it is left out
where it is not installed. (It needs LLVM 16 or newer: DRJIT_LIBLLVM_PATH.)
"""

import argparse
import resource
import subprocess
import sys
import time

import numpy as np
import smithwalk

PAIRS = 1_000_000
RUNS = 10
COLOR = (1.0, 0.71, 0.29)


def directions(rng):
    """A million above the surface."""
    return smithwalk.spherical(0.05 + 0.95 * rng.random(PAIRS), 2.0 * np.pi * rng.random(PAIRS))


def seconds(run):
    """CPU and wall-clock seconds of one of RUNS."""
    cpu, wall = time.process_time(), time.perf_counter()
    for _ in range(RUNS):
        run()
    return (time.process_time() - cpu) / RUNS, (time.perf_counter() - wall) / RUNS


def child(program, runs):
    """CPU and wall-clock seconds of a program that runs so many times."""
    def used():
        usage = resource.getrusage(resource.RUSAGE_CHILDREN)
        return usage.ru_utime + usage.ru_stime
    cpu, wall = used(), time.perf_counter()
    subprocess.run([program, str(runs)], check=True, stdout=subprocess.DEVNULL)
    return used() - cpu, time.perf_counter() - wall


def rust(program):
    """CPU and wall-clock seconds of one of RUNS; the difference leaves out what it takes to start."""
    once, more = child(program, 1), child(program, RUNS + 1)
    return tuple((b - a) / RUNS for a, b in zip(once, more))


def least(rounds):
    """Of CPU and of wall-clock seconds."""
    return [min(times) for times in zip(*rounds)]


def main():
    """A line each."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--million", required=True, help="the program of the Rust example")
    parser.add_argument("--rounds", type=int, default=5)
    args = parser.parse_args()
    rng = np.random.default_rng(1)
    wi, wo = directions(rng), directions(rng)
    gold = smithwalk.conductor(alpha=0.5, color=COLOR)

    def orders():
        gold.eval(wi, wo, samples=1)

    orders()
    rounds = [(seconds(orders), rust(args.million)) for _ in range(args.rounds)]
    (ours, ours_wall), (theirs, theirs_wall) = (least(side) for side in zip(*rounds))
    print(f"CPU: Python {ours:.3f} s, Rust {theirs:.3f} s, ratio {ours / theirs:.2f}")
    print(f"wall clock: Python {ours_wall:.3f} s, Rust {theirs_wall:.3f} s, ratio {ours_wall / theirs_wall:.2f}")
    try:
        import drjit as dr
        import mitsuba as mi
    except ImportError:
        print("mitsuba is not there")
        return
    mi.set_variant("llvm_ad_rgb")
    bsdf = mi.load_dict({"type": "roughconductor", "material": "none", "distribution": "ggx", "alpha": 0.5,
                         "specular_reflectance": {"type": "rgb", "value": list(COLOR)}})
    si = dr.zeros(mi.SurfaceInteraction3f, PAIRS)
    si.wi, out = mi.Vector3f(wi.T), mi.Vector3f(wo.T)

    def evaluate():
        dr.eval(bsdf.eval(mi.BSDFContext(), si, out))
        dr.sync_thread()

    evaluate()
    single, _ = least(seconds(evaluate) for _ in range(args.rounds))
    print(f"CPU: Mitsuba {mi.__version__}, single scattering: {single:.4f} s, ratio {ours / single:.0f}")


if __name__ == "__main__":
    sys.exit(main())
