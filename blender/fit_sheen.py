"""Fit the sheen that measure_sheen.py measured, and write it as Rust.

    python3 blender/fit_sheen.py MEASURED.csv src/bsdf/sheen/fit.rs

The lobe is a linearly transformed cosine (Zeltner, Burley and Chiang 2022, "Practical
Multiple-Scattering Sheen Using Linearly Transformed Cosines") of albedo R: the cosine lobe
that M⁻¹ = [[A, 0, B], [0, A, 0], [0, 0, 1]] takes ω_i to, x along the projection of ω_o.
A and B are those whose mean ω_i is the measured one. logit R, ln A and B are polynomials of
Chebyshev's in 2 · roughness − 1 and 2 √cosθ_o − 1.
"""

import csv
import math
import sys

import numpy as np

DEGREE = 7
LEAST_ROUGHNESS = 0.1
LEAST_ALBEDO = 2e-4  # below it the mean of the lobe was not measured


def read(path):
    """The columns of the measurement."""
    with open(path, encoding="utf-8") as f:
        rows = [row for row in csv.reader(line for line in f if not line.startswith("#"))]
    names, rows = rows[0], np.array([[float(x) for x in row] for row in rows[1:]])
    return {name: rows[:, i] for i, name in enumerate(names)}


def cosine_lobe(n=128):
    """Directions of equal weight of the cosine lobe."""
    u, phi = np.meshgrid((np.arange(n) + 0.5) / n, (np.arange(n) + 0.5) * 2 * math.pi / n)
    r = np.sqrt(u)
    return r * np.cos(phi), r * np.sin(phi), np.sqrt(1 - u)


def mean(a, b, lobe):
    """Mean z and x of the transformed lobe."""
    x, y, z = lobe
    x, y = (x - b * z) / a, y / a
    length = np.sqrt(x * x + y * y + z * z)
    return np.array([(z / length).mean(), (x / length).mean()])


def invert(target, lobe):
    """A and B by Newton's method."""
    a = next((a for a in np.exp(np.linspace(math.log(0.02), math.log(2), 60))
              if mean(a, 0.0, lobe)[0] >= target[0]), 1.0)
    b = 0.0
    for _ in range(60):
        f = mean(a, b, lobe) - target
        if np.abs(f).max() < 1e-7:
            break
        h = 1e-4
        jacobian = np.stack([(mean(a * (1 + h), b, lobe) - mean(a, b, lobe)) / (a * h),
                             (mean(a, b + h, lobe) - mean(a, b, lobe)) / h], axis=1)
        step = -np.linalg.solve(jacobian, f)
        while a + step[0] <= 0.2 * a:
            step /= 2
        a, b = a + step[0], b + step[1]
    return a, b


def main(measured, out):
    """Fit and write."""
    data = read(measured)
    r, c, albedo = data["roughness"], data["cos"], data["albedo"]
    lobe = cosine_lobe()
    known = (albedo > LEAST_ALBEDO) & (r >= LEAST_ROUGHNESS - 1e-9)
    pairs = np.full((len(r), 2), np.nan)
    for i in np.flatnonzero(known):
        pairs[i] = invert(np.array([data["mean_z"][i], data["mean_x"][i]]), lobe)

    vander = np.polynomial.chebyshev.chebvander
    x, y = vander(2 * r - 1, DEGREE), vander(2 * np.sqrt(c) - 1, DEGREE)
    basis = (x[:, :, None] * y[:, None, :]).reshape(len(r), -1)
    clipped = np.clip(albedo, 1e-6, 1)
    everywhere = (r >= LEAST_ROUGHNESS - 1e-9) & (albedo > 0)

    def fit(target, weight, rows):
        solution = np.linalg.lstsq(basis[rows] * weight[rows, None], target[rows] * weight[rows], rcond=None)
        return solution[0]

    logit = np.log(clipped / (1 - clipped))
    spread = np.clip(clipped * (1 - clipped), 1e-4, 1) ** 0.8
    seen = np.sqrt(np.clip(clipped, 0.02, 1))
    fits = {
        "LOGIT_ALBEDO": fit(logit, spread, everywhere),
        "LN_A": fit(np.log(pairs[:, 0]), seen, known),
        "B": fit(pairs[:, 1], seen, known),
    }
    error = np.abs(1 / (1 + np.exp(-(basis @ fits["LOGIT_ALBEDO"]))) - albedo)
    for least in (LEAST_ROUGHNESS, 0.3):
        rows = everywhere & (r >= least - 1e-9)
        a = np.exp(basis[rows & known] @ fits["LN_A"])
        b = basis[rows & known] @ fits["B"]
        turned = np.array([mean(*ab, lobe) for ab in zip(a, b)])
        off = np.abs(turned - np.stack([data["mean_z"], data["mean_x"]], 1)[rows & known])
        light = albedo[rows & known]
        print(f"from roughness {least:g}: albedo within {error[rows].max():.4f}, mean of ω_i within "
              f"{off.max():.3f}, within {off[light > 0.02].max():.3f} where the albedo is above 0.02")
    with open(out, "w", encoding="utf-8") as f:
        f.write("//! Written by blender/fit_sheen.py from what blender/measure_sheen.py measured.\n\n"
                "/// Degree of the polynomials.\n"
                f"pub(super) const DEGREE: usize = {DEGREE};\n")
        docs = {"LOGIT_ALBEDO": "ln(R/(1 − R))", "LN_A": "ln A", "B": "B"}
        for name, values in fits.items():
            f.write(f"\n/// {docs[name]}: a row for each degree in the roughness.\n"
                    f"pub(super) const {name}: [[f32; DEGREE + 1]; DEGREE + 1] = [\n")
            for row in values.reshape(DEGREE + 1, DEGREE + 1):
                f.write("    [" + ", ".join(f"{v:.5}" if abs(v) >= 1e-4 else f"{v:.8f}" for v in row) + "],\n")
            f.write("];\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
