#!/usr/bin/env python3
"""Times a million evaluations in Python, and of single scattering in Mitsuba 3.

    python3 benches/python_speed.py [--repeats N]

Gold GGX of α 0.5, a million pairs of directions, one estimate of all orders each. Times are CPU
seconds of all threads, the least of the repeats; Mitsuba's `roughconductor` evaluates the first
order in closed form, compiled beforehand. Needs numpy, the package, and mitsuba (left out where
it is not there).
"""

import argparse
import sys
import time

import numpy as np
import smithwalk

PAIRS = 1_000_000
COLOR = (1.0, 0.71, 0.29)


def directions(rng):
    """A million above the surface."""
    return smithwalk.spherical(0.05 + 0.95 * rng.random(PAIRS), 2.0 * np.pi * rng.random(PAIRS))


def least(run, repeats):
    """CPU seconds of the fastest run."""
    times = []
    for _ in range(repeats):
        begin = time.process_time()
        run()
        times.append(time.process_time() - begin)
    return min(times)


def main():
    """A line each."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=5)
    args = parser.parse_args()
    rng = np.random.default_rng(1)
    wi, wo = directions(rng), directions(rng)
    gold = smithwalk.conductor(alpha=0.5, color=COLOR)
    ours = least(lambda: gold.eval(wi, wo, samples=1), args.repeats)
    print(f"Python, all orders: {ours:.3f} s")
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
    theirs = least(evaluate, args.repeats)
    print(f"Mitsuba {mi.__version__}, single scattering: {theirs:.4f} s; ratio {ours / theirs:.0f}")


if __name__ == "__main__":
    sys.exit(main())
