#!/usr/bin/env python3
"""Writes tables for `smithwalk conform`: what renderers and formulas say of rough surfaces.

    python3 benches/verdicts.py OUT_DIR [CYCLES.csv ...]

From the formulas: Kulla and Conty 2017 and Turquin 2019 on coloured GGX mirrors (albedo, and
mean albedo of the first). From files of `blender/measure_albedo.py` (those of tests/data where
none are named): Multiscatter GGX as all orders, and from Cycles 4 on GGX as the first. Needs
numpy.
"""

import csv
import glob
import math
import os
import sys

import numpy as np

ROOT = os.path.normpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
COLUMNS = ("quantity", "facets", "eta", "color", "distribution", "alpha", "alpha_y", "scattering",
           "cos", "azimuth", "value", "stderr", "freedom", "note")
GOLD = {"red": 1.0, "green": 0.71, "blue": 0.29}
COSINES = (0.999, 0.75, 0.5, 0.25, 0.1, 0.05)
ROUGHNESSES = (0.2, 0.4, 0.6, 0.8, 1.0)


def write(path, rows):
    """The rows, columns that a row has not being left empty."""
    with open(path, "w", newline="", encoding="utf-8") as file:
        out = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        out.writeheader()
        out.writerows(rows)
    print(f"{path}: {len(rows)} rows")


def single(alpha, cosines, side=1024):
    """Albedo of single scattering by white GGX mirrors, Smith's masking of both directions at once.

    Midpoints over visible normals (Dupuy and Benyoub 2023), each of which counts
    (1 + Λ_i)/(1 + Λ_i + Λ_o) where light leaves upwards.
    """
    middle = (np.arange(side) + 0.5) / side
    u, v = (a.ravel() for a in np.meshgrid(middle, middle))
    found = []
    for cos in cosines:
        sin = math.sqrt(1.0 - cos * cos)
        length = math.hypot(alpha * sin, cos)
        x, z = alpha * sin / length, cos / length
        up = (1.0 - u) * (1.0 + z) - z
        around = np.sqrt(np.maximum(1.0 - up * up, 0.0))
        m = np.array([around * np.cos(2 * np.pi * v) + x, around * np.sin(2 * np.pi * v), up + z])
        m *= np.array([[alpha], [alpha], [1.0]])
        m /= np.linalg.norm(m, axis=0)
        dot = m[0] * sin + m[2] * cos
        out = 2.0 * dot * m[2] - cos
        tan2 = np.maximum(1.0 - out * out, 0.0) / np.maximum(out * out, 1e-30)
        masked = [(math.sqrt(1.0 + (alpha * sin / cos) ** 2) - 1.0) / 2, (np.sqrt(1.0 + alpha**2 * tan2) - 1.0) / 2]
        found.append(np.where(out > 0.0, (1.0 + masked[0]) / (1.0 + masked[0] + masked[1]), 0.0).mean())
    return np.array(found)


def formulas(folder):
    """Kulla–Conty and Turquin on gold's three channels, whose facets reflect alike at all angles."""
    nodes, weights = np.polynomial.legendre.leggauss(12)
    nodes, weights = (nodes + 1.0) / 2, weights / 2
    tables = {"kulla_conty": [], "turquin": []}
    for r in ROUGHNESSES:
        alpha = r * r
        e = single(alpha, COSINES)
        mean = float(2.0 * (weights * nodes * single(alpha, nodes, 512)).sum())
        for name, c in GOLD.items():
            kept = c * c * mean / (1.0 - c * (1.0 - mean))
            common = {"facets": "conductor", "color": c, "distribution": "ggx", "alpha": f"{alpha:.6g}"}
            for table, values in (("kulla_conty", c * e + kept * (1.0 - e)), ("turquin", c * e + c * c * (1.0 - e))):
                tables[table] += [{**common, "quantity": "albedo", "cos": cos, "value": f"{value:.5f}",
                                   "note": f"r {r} {name}"} for cos, value in zip(COSINES, values)]
            tables["kulla_conty"].append({**common, "quantity": "mean_albedo", "note": f"r {r} {name}",
                                          "value": f"{c * mean + kept * (1.0 - mean):.4f}"})
    for name, rows in tables.items():
        write(os.path.join(folder, f"{name}.csv"), rows)


def alphas(roughness, anisotropy):
    """α along x and y as the Anisotropic node takes them."""
    alpha = roughness * roughness
    if anisotropy < 0.0:
        x, y = alpha / (1.0 + anisotropy), alpha * (1.0 + anisotropy)
    else:
        x, y = alpha * (1.0 - anisotropy), alpha / (1.0 - anisotropy)
    return f"{min(x, 1.0):.9g}", f"{min(y, 1.0):.9g}"


def cycles(folder, path):
    """A file of measure_albedo.py, whose errors come from the scatter of 16 pixels."""
    stem = os.path.basename(path).removesuffix(".csv")
    version = tuple(int(n) for n in stem.split("_")[1].split("."))
    with open(path, encoding="utf-8") as file:
        measured = list(csv.DictReader(line for line in file if not line.startswith("#")))
    for kind, scattering in (("MULTI_GGX", "multiple"), ("GGX", "single")):
        if scattering == "single" and version < (4, 0):
            continue  # it masks both directions apart
        rows = []
        for m in (m for m in measured if m["distribution"] == kind):
            r = float(m["roughness"])
            common = {"distribution": "ggx", "scattering": scattering, "freedom": 15}
            if "ior" in m:
                x, _ = alphas(r, 0.0)
                cos = float(m["cos"]) * (1 if m["side"] == "outside" else -1)
                rows += [{**common, "quantity": quantity, "facets": "dielectric", "eta": m["ior"], "alpha": x,
                          "cos": cos, "value": m[key], "stderr": m[f"{key}_se"], "note": f"r {r} {key}"}
                         for quantity, key in (("albedo", "r"), ("transmitted", "t"))]
                continue
            x, y = alphas(r, float(m["anisotropy"]))
            azimuth = -360.0 * (0.25 + float(m["rotation"]))
            rows += [{**common, "quantity": "albedo", "facets": "conductor", "color": color, "alpha": x, "alpha_y": y,
                      "cos": m["cos"], "azimuth": azimuth, "value": m[name], "stderr": m[f"{name}_se"],
                      "note": f"r {r} a {m['anisotropy']} {name}"} for name, color in GOLD.items()]
        if rows:
            write(os.path.join(folder, f"{stem}_{scattering}.csv"), rows)


def main():
    """All of them."""
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    folder = sys.argv[1]
    os.makedirs(folder, exist_ok=True)
    formulas(folder)
    for path in sys.argv[2:] or sorted(glob.glob(os.path.join(ROOT, "tests", "data", "cycles_*_albedo_*.csv"))):
        cycles(folder, path)


if __name__ == "__main__":
    main()
