#!/usr/bin/env python3
"""Where rays meet a Gaussian surface, and which of them leave it, beside the model.

    python3 benches/heights.py docs/images/heights.svg docs/images/single_in_plane.svg

A ray at a fixed slant sees its own vertical section of the surface alone, which is a Gaussian
process: these are exact statistics of the surface of docs/explicit-surface.md, without a mesh.
Draws the four cases of heights, and prints how often rays leave that start at a point of the
surface, by its height and by its slope. α = 1; needs numpy and matplotlib.
"""

import argparse
import math

import numpy as np

PROFILES, CELLS, PER_LENGTH = 4000, 1536, 24
LENGTH = 2.0  # correlation length in RMS heights: slopes have the variance 2/ℓ² = α²/2
STEP = LENGTH / PER_LENGTH
BINS = np.linspace(-3.0, 3.0, 61)
erfc = np.vectorize(math.erfc)


def profiles(rng):
    """Periodic sections with the autocorrelation exp(−r²/ℓ²)."""
    r = np.minimum(np.arange(CELLS), CELLS - np.arange(CELLS)) * STEP
    power = np.maximum(np.fft.rfft(np.exp(-((r / LENGTH) ** 2))).real, 0.0)
    return np.fft.irfft(np.fft.rfft(rng.standard_normal((PROFILES, CELLS))) * np.sqrt(power), CELLS)


def below(h):
    """C1, the share of the surface below h."""
    return 0.5 * erfc(-h / math.sqrt(2.0))


def smith_lambda(slope):
    """Λ of Beckmann, α = 1, for rays of this slope dz/dr > 0 (Heitz 2014, eq. 53)."""
    return math.exp(-slope * slope) / (2.0 * slope * math.sqrt(math.pi)) - 0.5 * math.erfc(slope)


def slope_of(z):
    return abs(z) / math.sqrt(1.0 - z * z)


def seen(h, slope):
    """Heights that rays from outside meet, with weights: what rises above all before it."""
    line = np.concatenate([h, h], 1) + slope * STEP * np.arange(2 * CELLS)
    top = np.maximum.accumulate(line, 1)
    return h, np.diff(top, axis=1)[:, CELLS - 1 :]


def started(h, slope, up):
    """Heights that rays meet from height 0 in the free space."""
    heights, hits, starts = [], 0, 0
    sign = 1.0 if up else -1.0
    line = sign * slope * STEP * np.arange(CELLS)
    for at in range(0, CELLS, CELLS // 8):
        rolled = np.roll(h, -at, 1)
        free = rolled[:, 0] < 0.0
        met = rolled[free] > line
        first = met.argmax(1)
        hit = met.any(1)
        # Between two points of the section.
        heights.append(sign * slope * STEP * (first[hit] - 0.5))
        hits, starts = hits + hit.sum(), starts + len(hit)
    return np.concatenate(heights), hits / starts


def escapes(h, slope):
    """Whether a ray that goes up from each point of the surface leaves; the surface's slope there."""
    line = np.concatenate([h, h], 1) - slope * STEP * np.arange(2 * CELLS)
    ahead = np.maximum.accumulate(line[:, ::-1], 1)[:, ::-1]
    own = (np.roll(h, -1, 1) - np.roll(h, 1, 1)) / (2.0 * STEP)
    return line[:, :CELLS] >= ahead[:, 1 : CELLS + 1], own


def cells_of(values, count):
    """Each value's bin of `count` that hold as many values each."""
    edges = np.quantile(values, np.arange(1, count) / count)
    return np.searchsorted(edges, values)


def correlation(h, z):
    """Prints how far the model's chance to leave is off, by height and slope."""
    slope = slope_of(z)
    leaves, own = escapes(h, slope)
    front = own < slope
    leaves, height, own = leaves[front].astype(float), h[front], own[front]
    model = below(height[::7]) ** smith_lambda(slope)
    leaves, height, own = leaves[::7], height[::7], own[::7]
    row, column = cells_of(height, 24), cells_of(own, 16)
    cell = row * 16 + column
    count = np.maximum(np.bincount(cell, minlength=384), 1)
    share = count / count.sum()
    measured = np.bincount(cell, leaves, 384) / count
    predicted = np.bincount(cell, model, 384) / count
    rows = np.arange(384) // 16
    by_row = np.bincount(rows, share)
    given_height = (np.bincount(rows, share * measured) / by_row)[rows]
    model_height = (np.bincount(rows, share * predicted) / by_row)[rows]
    rms = lambda x: math.sqrt((share * x * x).sum())
    print(
        f"| {z} | {leaves.mean():.4f} | {model.mean():.4f} | {rms(measured - predicted):.4f} "
        f"| {rms(given_height - model_height):.4f} | {rms(measured - predicted - given_height + model_height):.4f} |"
    )


def single(h, cos, psi):
    """f cosθ_o in 1/sr of a white mirror's first order in the plane of incidence, light from −x at
    `cos`, towards the angle `psi` (radians) on the other side: surface, Smith, V-cavities."""
    wi, wo = np.array([-math.sqrt(1.0 - cos * cos), cos]), np.array([math.sin(psi), math.cos(psi)])
    m = (wi + wo) / math.hypot(*(wi + wo))
    tan = m[0] / m[1]
    d = math.exp(-tan * tan) / (math.pi * m[1] ** 4)
    to_light, own = escapes(h[:, ::-1], wi[1] / -wi[0])
    to_light, own = to_light[:, ::-1], -own[:, ::-1]
    side = h if psi > 0.0 else h[:, ::-1]
    to_eye, _ = escapes(side, wo[1] / abs(wo[0]))
    to_eye = to_eye if psi > 0.0 else to_eye[:, ::-1]
    # Facets of this normal, to a tenth of their slope: the surface falls where the normal leans to +x.
    facets = np.abs(own + tan) < 0.05
    # Where there are none D is next to nothing as well.
    surface = (to_light & to_eye)[facets].mean() if facets.any() else 0.0
    smith = 1.0 / (1.0 + smith_lambda(wi[1] / -wi[0]) + smith_lambda(wo[1] / abs(wo[0])))
    cavity = min(1.0, *(2.0 * m[1] * w[1] / (w @ m) for w in (wi, wo)))
    return [d * g / (4.0 * cos) for g in (surface, smith, cavity)]


def main():
    """The figure and the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("figure", help="of heights")
    parser.add_argument("single", help="of single scattering")
    args = parser.parse_args()
    import matplotlib

    matplotlib.use("Agg")
    matplotlib.rcParams["svg.hashsalt"] = "heights"
    import matplotlib.pyplot as plt

    h = profiles(np.random.default_rng(1))
    figure, axes = plt.subplots(1, 4, figsize=(13, 3), sharey=True)
    middle = (BINS[:-1] + BINS[1:]) / 2
    edge = below(BINS)

    def draw(axis, title, heights, weights, model):
        density, _ = np.histogram(heights, BINS, weights=weights, density=True)
        axis.plot(middle, density, ".", label="surface")
        axis.plot(middle, np.diff(model) / np.diff(BINS) / (model[-1] - model[0]), label="model")
        axis.set(title=title, xlabel="height (RMS heights)")

    draw(axes[0], "outside, normal incidence", h.ravel(), None, edge)
    heights, weights = seen(h, slope_of(0.1))
    draw(axes[1], "outside, d_z = −0.1", heights.ravel(), weights.ravel(), edge ** (1.0 + smith_lambda(slope_of(0.1))))
    down = slope_of(0.3)
    heights, _ = started(h, down, False)
    draw(axes[2], "inside, going down, d_z = −0.3", heights, None, np.minimum(edge / 0.5, 1.0) ** (1.0 + smith_lambda(down)))
    heights, hits = started(h, down, True)
    rise = 1.0 - np.minimum(0.5 / edge, 1.0) ** smith_lambda(down)
    draw(axes[3], "inside, going up, d_z = 0.3", heights, None, rise)
    axes[0].legend()
    axes[0].set_ylabel("density")
    figure.tight_layout()
    figure.savefig(args.figure, metadata={"Date": None})

    figure, axes = plt.subplots(1, 2, figsize=(9, 3))
    angles = np.radians(np.arange(-75.0, 86.0, 10.0))
    for axis, cos in zip(axes, (0.5, 0.2)):
        lobes = np.array([single(h[: PROFILES // 4], cos, psi) for psi in angles])
        for name, mark, lobe in zip(("surface", "Smith", "V-cavities"), (".", "-", "--"), lobes.T):
            axis.plot(np.degrees(angles), lobe, mark, label=name)
        axis.set(title=f"first order, light from {math.degrees(math.acos(cos)):.0f}°", xlabel="ψ (°), away from the light")
        off = np.abs(lobes[:, 1:] - lobes[:, :1]).sum(0) / lobes[:, 0].sum()
        print(f"cosθ {cos}: off the surface's first order by {off[0]:.3f} (Smith), {off[1]:.3f} (V-cavities)")
    axes[0].legend()
    axes[0].set_ylabel("f cosθ_o (1/sr)")
    figure.tight_layout()
    figure.savefig(args.single, metadata={"Date": None})
    print(f"inside, going up, d_z = 0.3: {hits:.4f} hit on the surface, {1.0 - 0.5 ** smith_lambda(down):.4f} in the model\n")
    print("| d_z | leave | model | off, root mean square | by height alone | by slope at a height |\n|---|---|---|---|---|---|")
    for z in (0.1, 0.3, 0.5, 0.7):
        correlation(h, z)


if __name__ == "__main__":
    main()
