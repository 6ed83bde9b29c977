#!/usr/bin/env python3
"""Whether lanes, scalar evaluation and plain walks have the same expectation on every scene.

    benches/lanes.py [--smithwalk BINARY] [--scene NAME]... [--pixels N] [--seeds N]
                     [--spp N] [--plain-spp N] [--first-seed N] [--rate X]

Each scene is rendered as it comes, where paths split at their first surface and
rough metals are evaluated and sampled in lanes (`auto`), without splitting, so that
each evaluation stands alone (`scalar`: `auto` with one branch), and without splitting
by the random walk alone (`walk`), with seeds of their own. In every block of 8 × 8 pixels
and every channel Welch's t says whether two of them have the same mean, given as the z of
the normal distribution that is as unlikely; so does that of the whole image. All must
stay below Šidák's bound for a chance of --rate on one scene and pair. The two halves of
`auto`'s seeds against each other show what chance does.

Standard errors are those of the seeds' spread. An image's own take its samples for
independent; they are stratified, and errors come out at twice what they are, which would
hide a bias twice as large. With few samples noise is skewed, and a block where one of the
two has missed what is rare and bright can fail: it does so no longer with other seeds and
more samples, where what is biased fails the more.

The last column but one compares, at --bits-spp samples, one thread with two and the kernel
that fits with the one that has everything: the images must be the same to the bit.
Writes a table to stdout; leaves with 1 if a test failed. Needs numpy and scipy.
"""

import argparse
import math
import os
import re
import sys
import tempfile

import numpy as np
from scipy import stats

from command import run

ROOT = os.path.normpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
sys.path.append(os.path.join(ROOT, "blender", "smithwalk_export"))
import exr  # noqa: E402: the add-on's reader

BLOCK = 8  # pixels
ROUNDING = 2.0**-20  # of a mean, relative
ESTIMATORS = {
    "auto": [],
    "scalar": ["-D", "sampling.branches=1"],
    "walk": ["-D", "sampling.branches=1", "--estimator", "walk"],
}


def scene_file(name):
    """The path of a scene of the repository."""
    return os.path.join(ROOT, "scenes", name, "scene.yaml")


def size(name, pixels):
    """Width and height in a scene's proportions, whole blocks of about so many pixels."""
    with open(scene_file(name), encoding="utf-8") as file:
        text = file.read()
    full = [int(re.search(rf"^  {side}: (\d+)", text, re.MULTILINE)[1]) for side in ("width", "height")]
    scale = math.sqrt(pixels / math.prod(full))
    return [BLOCK * max(round(scale * side / BLOCK), 1) for side in full]


def sidak(rate, tests):
    """What all of so many independent standard normal |z| stay below but for a chance of `rate`."""
    return stats.norm.isf(-math.expm1(math.log1p(-rate) / tests) / 2)


def welch(a, b):
    """Normal z of means over the first axis, differences, and their standard errors."""
    variances = [np.var(x, axis=0, ddof=1) / len(x) for x in (a, b)]
    means = [np.mean(x, axis=0) for x in (a, b)]
    off = means[0] - means[1]
    freedom = sum(variances)**2 / np.maximum(sum(v * v / (len(x) - 1) for v, x in zip(variances, (a, b))), 1e-300)
    error = np.sqrt(sum(variances) + (ROUNDING * np.maximum(*map(abs, means)))**2)
    t = np.where(off == 0, 0, off / np.maximum(error, 1e-300))
    z = np.sign(t) * stats.norm.isf(stats.t.sf(abs(t), np.maximum(freedom, 1)))
    return z, off, error


class Scene:
    """One scene at one size."""

    def __init__(self, args, name, folder):
        self.args, self.name, self.folder = args, name, folder
        self.size = size(name, args.pixels)
        self.blocks = math.prod(self.size) // BLOCK**2
        self.seconds = 0.0

    def render(self, seed, spp, *options):
        """Radiance by row, column and channel."""
        path = os.path.join(self.folder, "image.exr")
        said = run([self.args.smithwalk, "render", scene_file(self.name), "-o", path, "--seed", str(seed),
                    "--spp", str(spp), "-D", f"film.width={self.size[0]}", "-D", f"film.height={self.size[1]}",
                    *options])
        self.seconds += float(re.search(r"\(([\d.]+) s CPU\)", said)[1])
        channels = exr.read_channels(path)
        return np.stack([channels[c] for c in "RGB"], axis=-1)

    def same_bits(self):
        """Whether neither threads nor what the kernel has in it change a bit."""
        first, *others = (self.render(self.args.first_seed, self.args.bits_spp, *options).tobytes()
                          for options in (["--threads", "1"], ["--threads", "2"], ["--threads", "1", "--all-in"]))
        return all(other == first for other in others)

    def block_means(self, estimator, first_seed):
        """Of --seeds images: seed, row, column and channel."""
        spp = self.args.spp if estimator == "auto" else self.args.plain_spp
        images = np.stack([self.render(first_seed + k, spp, *ESTIMATORS[estimator]) for k in range(self.args.seeds)])
        width, height = self.size
        images = images.reshape(len(images), height // BLOCK, BLOCK, width // BLOCK, BLOCK, 3)
        return images.astype(np.float64).mean(axis=(2, 4))

    def test(self, a, b):
        """The cells of the table, and whether the test passed."""
        worst = abs(welch(a, b)[0]).max()
        z, off, error = welch(a.mean(axis=(1, 2)), b.mean(axis=(1, 2)))
        c = abs(z).argmax()
        percent = 100 / b[..., c].mean()
        passed = worst < sidak(self.args.rate, 3 * self.blocks) and abs(z[c]) < sidak(self.args.rate, 3)
        cells = f"{worst:.2f} | {percent * off[c]:+.3f} ± {percent * error[c]:.3f} ({z[c]:+.1f} σ)"
        return cells + ("" if passed else " **fails**"), passed

    def row(self):
        """The row of the table, and whether all tests passed."""
        args = self.args
        auto, scalar, walk = (self.block_means(estimator, args.first_seed + k * args.seeds)
                              for k, estimator in enumerate(ESTIMATORS))
        half = args.seeds // 2
        tests = [self.test(auto, scalar), self.test(auto, walk), self.test(auto[:half], auto[half:])]
        same = self.same_bits()
        row = (f"| {self.name} | {self.size[0]} × {self.size[1]} | {self.blocks} "
               f"| {sidak(args.rate, 3 * self.blocks):.2f} | {' | '.join(cells for cells, _ in tests)} "
               f"| {'same' if same else '**differ**'} | {self.seconds:.0f} |")
        return row, same and all(passed for _, passed in tests)


def main():
    """Parse, render, test, print."""
    everything = sorted(name for name in os.listdir(os.path.join(ROOT, "scenes")) if os.path.exists(scene_file(name)))
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--smithwalk", default=os.path.join(ROOT, "target", "release", "smithwalk"))
    parser.add_argument("--scene", action="append", choices=everything,
                        help="this one alone; may be given several times")
    parser.add_argument("--pixels", type=int, default=6000, help="of each image, about")
    parser.add_argument("--seeds", type=int, default=16, help="of each estimator")
    parser.add_argument("--spp", type=int, default=4, help="samples per pixel and seed where paths split")
    parser.add_argument("--plain-spp", type=int, default=24, help="samples per pixel and seed where they do not")
    parser.add_argument("--bits-spp", type=int, default=2, help="samples per pixel for the comparison of bits")
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--rate", type=float, default=1e-3, help="false alarms of each test")
    args = parser.parse_args()
    print("| scene | pixels | blocks | bound | auto − scalar: worst block \\|z\\| | mean, % "
          "| auto − walk: worst \\|z\\| | mean, % | halves of auto: worst \\|z\\| | mean, % | bits | CPU s |")
    print("|---" * 12 + "|", flush=True)
    passed = True
    with tempfile.TemporaryDirectory() as folder:
        for name in args.scene or everything:
            row, fine = Scene(args, name, folder).row()
            print(row, flush=True)
            passed &= fine
    sys.exit(0 if passed else 1)


if __name__ == "__main__":
    main()
