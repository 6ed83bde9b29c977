"""Multiple-scattering Smith microfacet BSDFs on numpy arrays.

The model is Heitz, Hanika, d'Eon and Dachsbacher 2016, "Multiple-Scattering
Microfacet BSDFs with the Smith Model": light walks among micro-facets until it
leaves. Every value is a Monte Carlo estimate with a standard error.

    >>> import numpy as np, smithwalk
    >>> gold = smithwalk.conductor(alpha=0.64, color=(1.0, 0.71, 0.29))
    >>> value, stderr = gold.eval(smithwalk.spherical(0.5), smithwalk.spherical(0.8, np.pi), samples=4096)

Conventions
    Directions are unit vectors (…, 3) in the local frame, z = the macroscopic
    normal, x = the tangent; both wi and wo point away from the surface.
    Values are f(wi, wo) |cosθ_o| in 1/sr: the cosine of wo is inside. Colours
    are three independent channels. wi may be below a dielectric (z < 0); the
    lower side of opaque surfaces is black. Radiance is carried as L/n², so
    without absorption the integral of a value over wo is 1.

    Arrays broadcast as in numpy, apart from the last axis. Results depend on
    the arguments and the seed, never on the number of threads.
"""

from __future__ import annotations

import operator
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _smithwalk
from ._command import Render, RenderError, SceneMaterial, material, principled, render
from ._spectrum import rgb_index, rgb_reflectance

__version__: str = _smithwalk.__version__
__all__ = [
    "Albedo",
    "Interface",
    "Lobe",
    "Material",
    "NormalTable",
    "Render",
    "RenderError",
    "SceneMaterial",
    "conductor",
    "dielectric",
    "diffuse",
    "lambert",
    "layered",
    "material",
    "principled",
    "render",
    "rgb_index",
    "rgb_reflectance",
    "spherical",
]

Array = NDArray[np.float64]


_Triple = tuple[float, float, float]
_Normals = tuple[str, tuple[float, float], float]
_Bottom = tuple[str, _Normals, _Triple, _Triple]
_BLACK: _Triple = (0.0, 0.0, 0.0)


class NormalTable(NamedTuple):
    """A distribution of normals by rings of constant density: `distribution=NormalTable(edges, density)`."""

    edges: ArrayLike
    """Angles from the macroscopic normal in radians, (rings + 1,), from 0 up to π/2 at most."""
    density: ArrayLike
    """D of each ring up to a common factor, (rings,); it is scaled to ∫ D(m) m_z dm = 1."""


class Albedo(NamedTuple):
    """What becomes of the light from one direction, or from many: (…) is the shape of `cos`."""

    reflected: Array
    """Share of the light that comes back, (…, 3)."""
    reflected_stderr: Array
    """Its standard error, (…, 3)."""
    transmitted: Array
    """Share that goes through, (…, 3)."""
    transmitted_stderr: Array
    """Its standard error, (…, 3)."""
    orders: Array
    """Share (mean of the channels) that met k + 1 facets, (…, orders); the last has the rest."""
    mean_order: Array
    """Mean number of facets met by light that left, (…)."""


class Lobe(NamedTuple):
    """Where light from one direction goes, in bins of equal solid angle."""

    value: Array
    """Mean of f |cosθ_o| over each bin in 1/sr, (cosines, azimuths, 3)."""
    stderr: Array
    """Its standard error, the same shape."""
    cos: Array
    """Edges of the bins in cosθ_o, from 1 (the normal) down to −1, (cosines + 1,)."""
    phi: Array
    """Edges of the bins in azimuth, radians from the tangent, 0 to 2π, (azimuths + 1,)."""


def spherical(cos: ArrayLike, phi: ArrayLike = 0.0) -> Array:
    """Unit vectors (…, 3) at cosine `cos` from the normal and azimuth `phi` (radians) from the tangent."""
    cos, phi = np.broadcast_arrays(np.asarray(cos, float), np.asarray(phi, float))
    if not (np.abs(cos) <= 1.0).all():
        raise ValueError("cos: expected numbers from -1 to 1")
    sin = np.sqrt((1.0 - cos) * (1.0 + cos))
    return np.stack([sin * np.cos(phi), sin * np.sin(phi), cos], axis=-1)


class Material:
    """A rough surface, made by `conductor`, `dielectric`, `diffuse`, `lambert` or `layered`."""

    def __init__(self, surface: _smithwalk.Surface, description: str, bottom: _Bottom | None = None):
        self._surface = surface
        self._description = description
        self._bottom = bottom

    def __repr__(self) -> str:
        return f"smithwalk.{self._description}"

    def eval(
        self, wi: ArrayLike, wo: ArrayLike, *, estimator: str = "auto", samples: int = 64, seed: int = 0
    ) -> tuple[Array, Array]:
        """f(wi, wo) |cosθ_o| in 1/sr, all orders: (value, stderr), both (…, 3).

        `estimator`: 'position-free' (two walks with the depth integrated out; for
        conductors), 'two-walk' (for the rest), 'auto' (the better of the two),
        'walk' (the paper's, one-sided) or 'single' (the first order alone).
        `samples`: estimates per pair; the time goes with it.
        The standard error is that of the mean of `samples` estimates; one alone has
        none: NaN, as a read-only view. Those of
        'walk' have heavy tails where a rare first bounce matters: there both the
        value and the error it prints are too small until the rare event comes.
        Source: Heitz et al. 2016, § 4.3; two walks are combined by the balance
        heuristic (Veach 1997) over the paths of either.
        """
        wi, wo, shape = _pairs(wi, wo)
        value, stderr = self._surface.eval(wi, wo, estimator, _count("samples", samples), _seed(seed))
        if samples == 1:
            # A million rows of NaN would take a twentieth of the time.
            return value.reshape(*shape, 3), np.broadcast_to(np.nan, (*shape, 3))
        return value.reshape(*shape, 3), stderr.reshape(*shape, 3)

    def eval_orders(
        self,
        wi: ArrayLike,
        wo: ArrayLike,
        *,
        orders: int = 8,
        estimator: str = "auto",
        samples: int = 64,
        seed: int = 0,
    ) -> tuple[Array, Array]:
        """As `eval`, order by order: (value, stderr), both (…, orders, 3), in 1/sr.

        Element k of the axis `orders` is light that met k + 1 facets; the last has
        all that met more as well, so that the sum is `eval`'s.
        """
        wi, wo, shape = _pairs(wi, wo)
        orders = _count("orders", orders)
        value, stderr = self._surface.eval_orders(
            wi, wo, estimator, orders, _count("samples", samples), _seed(seed)
        )
        return value.reshape(*shape, orders, 3), stderr.reshape(*shape, orders, 3)

    def sample(self, wi: ArrayLike, *, seed: int = 0) -> tuple[Array, Array, NDArray[np.uint32]]:
        """One walk from each of `wi`: (wo (…, 3), weight (…, 3), order (…)).

        The weight is f |cosθ_o| over the density of the walk, the product of the
        facets' reflectances, at most 1. Where the light is absorbed, order and
        weight are 0 and wo is the null vector.
        """
        wi, shape = _directions("wi", wi)
        wo, weight, order = self._surface.sample(wi, _seed(seed))
        return wo.reshape(*shape, 3), weight.reshape(*shape, 3), order.reshape(shape)

    def pdf(self, wi: ArrayLike, wo: ArrayLike) -> Array:
        """A density of wo in 1/sr (no cosine) that stands in for the walk's, which has no closed form: (…).

        Positive wherever f is, and integrates to 1. For multiple importance
        sampling; not to divide a walk's weight by, which it has in it already.
        """
        wi, wo, shape = _pairs(wi, wo)
        return self._surface.pdf(wi, wo).reshape(shape)

    def albedo(
        self, cos: ArrayLike, *, phi: ArrayLike = 0.0, orders: int = 8, samples: int = 100_000, seed: int = 0
    ) -> Albedo:
        """Directional albedos at cosines `cos` of wi (negative: from below) and azimuths `phi` (radians)."""
        wi = spherical(cos, phi)
        shape = wi.shape[:-1]
        orders = _count("orders", orders)
        (r, r_se), (t, t_se), shares, mean = self._surface.albedo(
            wi.reshape(-1, 3), orders, _count("samples", samples), _seed(seed)
        )
        r, r_se, t, t_se = (a.reshape(*shape, 3) for a in (r, r_se, t, t_se))
        return Albedo(r, r_se, t, t_se, shares.reshape(*shape, orders), mean.reshape(shape))

    def lobe(
        self, wi: ArrayLike, bins: tuple[int, int] = (64, 64), *, samples: int = 1_000_000, seed: int = 0
    ) -> Lobe:
        """A histogram of `samples` walks from one direction `wi` (3,) over the whole sphere of wo.

        `bins`: (cosines, azimuths), all of equal solid angle 4π / (cosines · azimuths).
        """
        flat, shape = _directions("wi", wi)
        if shape != ():
            raise ValueError(f"wi: expected one direction (3,), found shape {(*shape, 3)}")
        rows, columns = (_count("bins", n) for n in bins)
        if rows * columns > 1 << 24:
            raise ValueError(f"bins: expected at most 2**24 bins, found {rows} x {columns}")
        value, stderr = self._surface.lobe(flat[0], (rows, columns), _count("samples", samples), _seed(seed))
        return Lobe(
            value.reshape(rows, columns, 3),
            stderr.reshape(rows, columns, 3),
            np.linspace(1.0, -1.0, rows + 1),
            np.linspace(0.0, 2.0 * np.pi, columns + 1),
        )


def conductor(
    *,
    alpha: float | tuple[float, float] | None = None,
    distribution: str | NormalTable = "ggx",
    gamma: float | None = None,
    color: ArrayLike | None = None,
    eta: ArrayLike | None = None,
    k: ArrayLike | None = None,
) -> Material:
    """Metal facets, by reflectance `color` at all angles, or by complex index `eta` + i `k`.

    `alpha`: slope roughness α (not its square root), one number or (α_x along the
    tangent, α_y); not for `distribution='quadratic'`, which has none. `distribution`:
    'ggx', 'beckmann', 'student-t', 'quadratic' or a `NormalTable`. `gamma`: exponent of 'student-t',
    above 1.5: 2 is GGX, large ones go to Beckmann (Ribardière et al. 2017). `color`:
    0 to 1, one number or three; default 1. `eta`, `k`: relative to the outside,
    one number or three each.
    """
    normals = _normals(distribution, alpha, gamma)
    if color is not None and (eta is not None or k is not None):
        raise ValueError("color: give either color or eta and k, not both")
    if (eta is None) != (k is None):
        raise ValueError(f"{'eta' if eta is None else 'k'}: eta and k go together")
    shown = f"conductor({_shown(distribution, alpha, gamma)}"
    if eta is not None:
        eta, k = _channels("eta", eta, 0.0, np.inf), _channels("k", k, 0.0, np.inf)
        if min(eta) <= 0.0:
            raise ValueError("eta: expected numbers above 0")
        surface = _smithwalk.Surface.conductor_complex(normals, _rings(distribution), eta, k)
        return Material(surface, f"{shown}, eta={eta}, k={k})", ("complex", normals, eta, k))
    color = _channels("color", 1.0 if color is None else color, 0.0, 1.0)
    surface = _smithwalk.Surface.conductor_color(normals, _rings(distribution), color)
    return Material(surface, f"{shown}, color={color})", ("color", normals, color, _BLACK))


def dielectric(
    *,
    alpha: float | tuple[float, float] | None = None,
    distribution: str | NormalTable = "ggx",
    gamma: float | None = None,
    eta: float = 1.5,
    color: ArrayLike = 1.0,
) -> Material:
    """Glass facets that reflect and refract.

    `alpha`, `distribution`, `gamma`: as for `conductor`. `eta`: index of refraction of the
    inside (z < 0) over that of the outside. `color`: what every facet multiplies
    the light by, 0 to 1.
    """
    normals = _normals(distribution, alpha, gamma)
    eta = float(eta)
    if not (0.0 < eta < np.inf):
        raise ValueError(f"eta: expected a number above 0, found {eta}")
    color = _channels("color", color, 0.0, 1.0)
    surface = _smithwalk.Surface.dielectric(normals, _rings(distribution), eta, color)
    return Material(surface, f"dielectric({_shown(distribution, alpha, gamma)}, eta={eta}, color={color})")


def diffuse(
    *,
    alpha: float | tuple[float, float] | None = None,
    distribution: str | NormalTable = "ggx",
    gamma: float | None = None,
    color: ArrayLike = 1.0,
) -> Material:
    """Lambertian facets of albedo `color`, 0 to 1. `alpha`, `distribution`, `gamma`: as for `conductor`."""
    normals = _normals(distribution, alpha, gamma)
    color = _channels("color", color, 0.0, 1.0)
    surface = _smithwalk.Surface.diffuse(normals, _rings(distribution), color)
    shown = f"diffuse({_shown(distribution, alpha, gamma)}, color={color})"
    return Material(surface, shown, ("diffuse", normals, color, _BLACK))


def lambert(*, color: ArrayLike = 1.0) -> Material:
    """A smooth diffuse surface of albedo `color`, 0 to 1, one number or three."""
    color = _channels("color", color, 0.0, 1.0)
    bottom = ("diffuse", ("ggx", (0.0, 0.0), 2.0), color, _BLACK)
    return Material(_smithwalk.Surface.layered([], bottom), f"lambert(color={color})", bottom)


class Interface(NamedTuple):
    """A dielectric interface and the slab below it, for `layered`."""

    ior: float
    """Absolute index of refraction of the medium below."""
    alpha: float | tuple[float, float] = 0.0
    """Slope roughness α, one number or (α_x, α_y); 0 is smooth."""
    distribution: str = "ggx"
    """'ggx' or 'beckmann'."""
    absorption: ArrayLike = 0.0
    """Absorption of the slab per unit of length, one number or three."""
    thickness: float = 1.0
    """Thickness of the slab, in that unit."""


def layered(interfaces: Sequence[Interface], base: Material | None = None) -> Material:
    """Interfaces from the top, in air, over a base: light walks among them, all orders at each.

    `base`: a `conductor`, `diffuse` or `lambert` material, or None, where the medium below
    the last interface goes on. In `eval` and `eval_orders` order 1 is light that met one facet
    at every surface; what smooth surfaces alone send into a single direction is not part of
    values, but is of `sample`, `albedo` and `lobe`. 'walk', 'two-walk' and 'position-free' are
    all the estimator of layers.
    Source: Guo, Hašan and Zhao 2018, "Position-Free Monte Carlo Simulation for Arbitrary
    Layered BSDFs".
    """
    if base is not None and (base._bottom is None or base._bottom[1][0] == "table"):
        raise ValueError("base: expected a conductor, diffuse or lambert material without a table, or None")
    layers = []
    for interface in interfaces:
        ior, alpha, distribution, absorption, thickness = Interface(*interface)
        pair = np.asarray(alpha, float)
        if pair.shape not in ((), (2,)) or not np.isfinite(pair).all() or not (pair >= 0.0).all():
            raise ValueError(f"alpha: expected one number from 0 or two, found {alpha!r}")
        x, y = np.broadcast_to(pair, 2)
        normals = (distribution, (float(x), float(y)), 2.0)
        layers.append((float(ior), normals, _channels("absorption", absorption, 0.0, np.inf), float(thickness)))
    surface = _smithwalk.Surface.layered(layers, None if base is None else base._bottom)
    return Material(surface, f"layered({list(interfaces)!r}, base={base!r})")


def _rings(distribution: str | NormalTable) -> tuple[list[float], list[float]] | None:
    if isinstance(distribution, str):
        return None
    return tuple(np.asarray(values, float).ravel().tolist() for values in NormalTable(*distribution))


def _alpha(distribution: str, alpha: float | tuple[float, float] | None) -> tuple[float, float]:
    if distribution == "quadratic":
        if alpha is not None:
            raise ValueError("alpha: the quadratic distribution has no roughness")
        return (1.0, 1.0)
    if alpha is None:
        raise ValueError("alpha: expected the slope roughness α, one number or (α_x, α_y)")
    pair = np.asarray(alpha, float)
    if pair.shape not in ((), (2,)) or not np.isfinite(pair).all() or not (pair > 0.0).all():
        raise ValueError(f"alpha: expected one number above 0 or two, found {alpha!r}")
    x, y = np.broadcast_to(pair, 2)
    return (float(x), float(y))


def _normals(
    distribution: str | NormalTable, alpha: float | tuple[float, float] | None, gamma: float | None
) -> tuple[str, tuple[float, float], float]:
    if not isinstance(distribution, str):
        if alpha is not None or gamma is not None:
            raise ValueError("alpha: a table has its roughness in it")
        return ("table", (1.0, 1.0), 2.0)
    if (gamma is None) == (distribution == "student-t"):
        raise ValueError("gamma: belongs to the distribution 'student-t', which needs it")
    exponent = 2.0 if gamma is None else float(gamma)
    if not (1.5 < exponent < np.inf):
        raise ValueError(f"gamma: expected a number above 1.5, found {gamma}")
    return (distribution, _alpha(distribution, alpha), exponent)


def _shown(distribution: str | NormalTable, alpha: object, gamma: object) -> str:
    shown = f"distribution={distribution!r}" + ("" if alpha is None else f", alpha={alpha}")
    return shown + ("" if gamma is None else f", gamma={gamma}")


def _channels(name: str, value: ArrayLike, least: float, most: float) -> tuple[float, float, float]:
    channels = np.asarray(value, float)
    if channels.shape not in ((), (3,)):
        raise ValueError(f"{name}: expected one number or three, found shape {channels.shape}")
    if not np.isfinite(channels).all() or not ((channels >= least) & (channels <= most)).all():
        raise ValueError(f"{name}: expected numbers from {least} to {most}, found {value!r}")
    r, g, b = np.broadcast_to(channels, 3)
    return (float(r), float(g), float(b))


def _directions(name: str, value: ArrayLike) -> tuple[Array, tuple[int, ...]]:
    """Unit vectors as (N, 3) and the shape they had, apart from the last axis."""
    vectors = np.asarray(value, float)
    if vectors.ndim == 0 or vectors.shape[-1] != 3:
        raise ValueError(f"{name}: expected directions (…, 3), found shape {vectors.shape}")
    flat, shape = np.ascontiguousarray(vectors.reshape(-1, 3)), vectors.shape[:-1]
    off = _smithwalk.first_not_unit(flat)
    if off is not None:
        where = tuple(int(i) for i in np.unravel_index(off, shape)) if shape else ()
        raise ValueError(f"{name}: expected unit vectors; {name}[{', '.join(map(str, where)) or '...'}] is {vectors[where]}")
    return flat, shape


def _pairs(wi: ArrayLike, wo: ArrayLike) -> tuple[Array, Array, tuple[int, ...]]:
    (wi, a), (wo, b) = _directions("wi", wi), _directions("wo", wo)
    try:
        shape = np.broadcast_shapes(a, b)
    except ValueError:
        raise ValueError(f"wo: shape {(*b, 3)} does not broadcast with wi's {(*a, 3)}") from None
    def spread(v: Array, own: tuple[int, ...]) -> Array:
        return np.ascontiguousarray(np.broadcast_to(v.reshape(*own, 3), (*shape, 3)).reshape(-1, 3))
    return spread(wi, a), spread(wo, b), shape


def _count(name: str, value: int) -> int:
    try:
        count = operator.index(value)
    except TypeError:
        raise TypeError(f"{name}: expected a whole number, found {value!r}") from None
    if not 1 <= count <= 1 << 40:
        raise ValueError(f"{name}: expected a number from 1 to 2**40, found {count}")
    return count


def _seed(value: int) -> int:
    try:
        return operator.index(value) % (1 << 64)
    except TypeError:
        raise TypeError(f"seed: expected a whole number, found {value!r}") from None
