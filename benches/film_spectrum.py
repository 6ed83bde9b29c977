#!/usr/bin/env python3
"""How far the few wavelengths of thin films are from CIE 1931's observer, and a fit of others.

    pip install numpy scipy colour-science
    benches/film_spectrum.py [--fit N] [--seed N]

Reflectances of red, green and blue by the table SPECTRUM of crates/model/src/film.rs against
sums in steps of 1 nm over the observer's tables: the largest and the mean over films of the
largest of the three. `--fit N` prints N wavelengths and weights: weights by least squares
over random films (index 1.2 to 2.5, up to 2 µm, cosθ 0.1 to 1) on plastics and metals,
wavelengths by the same in turn, from even steps of 1/λ.
"""

import argparse
import os
import re
import warnings

import numpy as np
from scipy.optimize import least_squares

with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # that it could plot
    import colour

ROOT = os.path.normpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
FILM = os.path.join(ROOT, "crates", "model", "src", "film.rs")
REC709 = np.array([[3.2404542, -1.5371385, -0.4985314],
                   [-0.9692660, 1.8760108, 0.0415560],
                   [0.0556434, -0.2040259, 1.0572252]])
METALS = (0.2 - 3.4j, 2.9 - 3.1j, 1.2 - 7j)
# What errors are told of: bases, films, thicknesses in nm, cosines.
SETS = {
    "metals of docs/layers.md": (METALS, (1.33, 1.8), (100, 300, 500, 800), (0.9, 0.5, 0.2)),
    "plastics of docs/layers.md": ((1.5, 1.9), (1.33, 1.8), (100, 300, 500, 800), (0.9, 0.5, 0.2)),
}
for what, bases in (("plastics", (1.3, 1.5, 1.7, 2.0)), ("metals", METALS)):
    for range_of, thicknesses in (("up to 1 µm", np.arange(0, 1001, 25)), ("of 1 to 2 µm", np.arange(1025, 2001, 25))):
        SETS[f"{what}, films {range_of}"] = (bases, (1.2, 1.33, 1.5, 1.8, 2.2, 2.5), thicknesses,
                                                (1, 0.8, 0.6, 0.4, 0.2, 0.1))
# What is fitted: thickest film in nm, and the weight of an error.
TRAINING = (("plastic", 1000, 4.0), ("plastic", 2000, 2.0), ("metal", 1000, 1.0), ("metal", 2000, 0.8))
FILMS = 700  # of each


def observer():
    """Wavelengths in nm, and the sensitivities of red, green and blue, each with a sum of 1."""
    table = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    rgb = REC709 @ table.values.T
    return table.wavelengths, rgb / rgb.sum(axis=1, keepdims=True)


def reflectance(wavelengths, bases, films, thicknesses, cosines):
    """Airy's formula for unpolarised light, a row for each film; indices are n − ik."""
    b, n, d, c = (np.asarray(x)[:, None] for x in (bases, films, thicknesses, cosines))
    sin2 = 1 - c * c
    inside, below = np.sqrt(1 - sin2 / n**2), np.sqrt(1 - sin2 / (b + 0j)**2)
    turn = np.exp(-4j * np.pi * n * inside * d / wavelengths)
    both = 0
    for outer, inner in (((c - n * inside) / (c + n * inside), (n * inside - b * below) / (n * inside + b * below)),
                         ((n * c - inside) / (n * c + inside), (b * inside - n * below) / (b * inside + n * below))):
        both = both + abs((outer + inner * turn) / (1 + outer * inner * turn))**2
    return both / 2


def integral(films, wavelengths, weights):
    """Red, green and blue of films, not clamped."""
    return np.concatenate([reflectance(wavelengths, *part) @ weights.T
                           for part in zip(*(np.array_split(x, 1 + len(x) // 2000) for x in films))])


def present():
    """The table of the model."""
    with open(FILM, encoding="utf-8") as file:
        rows = re.findall(r"^ {4}\[([\d.]+), (-?[\d.]+), (-?[\d.]+), (-?[\d.]+)\],$", file.read(), re.MULTILINE)
    table = np.array(rows, dtype=float)
    return table[:, 0], table[:, 1:].T


def fit(count, rng):
    """So many wavelengths, and their weights."""
    films, scale = [], []
    for kind, thickest, weight in TRAINING:
        base = rng.uniform(1.3, 2, FILMS) if kind == "plastic" else (
            rng.uniform(0.15, 4, FILMS) - 1j * rng.uniform(2, 8, FILMS))
        films.append((base, rng.uniform(1.2, 2.5, FILMS), rng.uniform(0, thickest, FILMS), rng.uniform(0.1, 1, FILMS)))
        scale += [weight] * FILMS
    films, scale = [np.concatenate(x) for x in zip(*films)], np.array(scale)[:, None]
    exact = integral(films, *observer()) * scale

    def weights(wavelengths):
        found = reflectance(wavelengths, *films) * scale
        # Sums of 1, and no larger weights than it takes.
        over = np.concatenate([found, np.full((1, count), 1e4), 3e-2 * np.eye(count)])
        aim = np.concatenate([exact, np.full((1, 3), 1e4), np.zeros((count, 3))])
        solution = np.linalg.lstsq(over, aim, rcond=None)[0]
        return solution.T, (found @ solution - exact).ravel()

    even = (np.arange(count) + 0.5) / count
    start = 1 / (1 / 400 + (1 / 690 - 1 / 400) * even)
    wavelengths = least_squares(lambda x: weights(x)[1], start, bounds=(370, 800), x_scale=3.0, max_nfev=40).x.round(2)
    rounded = weights(wavelengths)[0].round(6)
    for channel in rounded:
        largest = abs(channel).argmax()
        channel[largest] = round(channel[largest] + 1 - channel.sum(), 6)
    return wavelengths, rounded


def main():
    """Fit if asked for, and tell the errors."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--fit", type=int, metavar="N", help="so many wavelengths, some minutes")
    parser.add_argument("--seed", type=int, default=1, help="of the films to fit to")
    args = parser.parse_args()
    table = present() if args.fit is None else fit(args.fit, np.random.default_rng(args.seed))
    if args.fit is not None:
        for wavelength, weights in zip(table[0], table[1].T):
            print(f"    [{wavelength:.2f}, " + ", ".join(f"{weight:.6f}" for weight in weights) + "],")
    print("| films | largest | mean |\n|---|---|---|")
    for name, axes in SETS.items():
        films = [x.ravel() for x in np.meshgrid(*axes, indexing="ij")]
        off = abs(np.clip(integral(films, *table), 0, 1) - np.clip(integral(films, *observer()), 0, 1)).max(axis=1)
        print(f"| {name} | {off.max():.4f} | {off.mean():.5f} |")


if __name__ == "__main__":
    main()
