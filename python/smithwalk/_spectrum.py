"""Measured indices of metals over wavelengths, as red, green and blue."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

# XYZ to linear Rec. 709 (ITU-R BT.709, white D65).
_RGB = np.array([[3.2404542, -1.5371385, -0.4985314], [-0.9692660, 1.8760108, 0.0415560], [0.0556434, -0.2040259, 1.0572252]])

# The angle at which F82 has its second value, 81.8°.
_GRAZING = 1.0 / 7.0


def _observer(nm: Array) -> Array:
    """x̄, ȳ, z̄ of the CIE 1931 standard observer, (…, 3), by the fit of Wyman, Sloan and Shirley 2013,
    "Simple Analytic Approximations to the CIE XYZ Color Matching Functions", JCGT 2 (2)."""

    def lobe(height: float, middle: float, below: float, above: float) -> Array:
        return height * np.exp(-0.5 * ((nm - middle) / np.where(nm < middle, below, above)) ** 2)

    x = lobe(1.056, 599.8, 37.9, 31.0) + lobe(0.362, 442.0, 16.0, 26.7) + lobe(-0.065, 501.1, 20.4, 26.2)
    y = lobe(0.821, 568.8, 46.9, 40.5) + lobe(0.286, 530.9, 16.3, 31.1)
    z = lobe(1.217, 437.0, 11.8, 36.0) + lobe(0.681, 459.0, 26.0, 13.8)
    return np.stack([x, y, z], axis=-1)


def fresnel(cos: ArrayLike, eta: ArrayLike, k: ArrayLike) -> Array:
    """Unpolarised reflectance of a metal of index `eta` + i `k` at cosine `cos`; arrays broadcast."""
    cos, index = np.asarray(cos, complex), np.asarray(eta) + 1j * np.asarray(k)
    inside = np.sqrt(index * index - (1.0 - cos * cos))
    s = (cos - inside) / (cos + inside)
    p = (index * index * cos - inside) / (index * index * cos + inside)
    return 0.5 * (np.abs(s) ** 2 + np.abs(p) ** 2)


def rgb_reflectance(wavelengths: ArrayLike, eta: ArrayLike, k: ArrayLike, cos: float = 1.0) -> Array:
    """Reflectance (3,) in linear Rec. 709 of a metal with `eta` and `k` at `wavelengths` (nm) in the air.

    The spectrum between 380 and 780 nm, linear between the wavelengths given, under light of
    equal energy, by the CIE 1931 observer; the light's own colour counts as white. Saturated metals are
    outside of Rec. 709: a channel may be above 1 or below 0.
    """
    wavelengths = np.asarray(wavelengths, float)
    if wavelengths.ndim != 1 or len(wavelengths) < 2 or not (np.diff(wavelengths) > 0.0).all():
        raise ValueError("wavelengths: expected numbers of nm that rise, two at least")
    nm = np.arange(380.0, 781.0)
    if wavelengths[0] > 400.0 or wavelengths[-1] < 700.0:
        raise ValueError(f"wavelengths: expected 400 to 700 nm covered, found {wavelengths[0]} to {wavelengths[-1]}")
    n, k = (np.interp(nm, wavelengths, np.broadcast_to(np.asarray(v, float), wavelengths.shape)) for v in (eta, k))
    observer = _observer(nm)
    seen = (fresnel(cos, n, k)[:, None] * observer).sum(0)
    return (_RGB @ seen) / (_RGB @ observer.sum(0))


def rgb_index(wavelengths: ArrayLike, eta: ArrayLike, k: ArrayLike) -> tuple[Array, Array]:
    """Indices (η (3,), k (3,)) for `conductor` that have the colour of a metal measured at `wavelengths` (nm).

    Each channel has its `rgb_reflectance` at normal incidence, held between 0.001 and 0.999, and,
    of all indices that do, the one nearest to it at 82° (Gulbrandsen 2014, "Artist Friendly
    Metallic Fresnel", JCGT 3 (4), eq. 5 to 7, has those).
    """
    normal = np.clip(rgb_reflectance(wavelengths, eta, k), 0.001, 0.999)
    grazing = rgb_reflectance(wavelengths, eta, k, _GRAZING)
    root = np.sqrt(normal)
    edge = np.linspace(0.0, 1.0, 2001)[:, None]
    n = edge * (1.0 - normal) / (1.0 + normal) + (1.0 - edge) * (1.0 + root) / (1.0 - root)
    kappa = np.sqrt(np.maximum(normal * (n + 1.0) ** 2 - (n - 1.0) ** 2, 0.0) / (1.0 - normal))
    best = np.abs(fresnel(_GRAZING, n, kappa) - grazing).argmin(0)
    channel = np.arange(3)
    return n[best, channel], kappa[best, channel]
