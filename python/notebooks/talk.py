# ---
# jupyter:
#   jupytext: {text_representation: {extension: .py, format_name: percent}}
# ---

# %% [markdown]
# # The figures of the talk, in arrays
#
# Heitz, Hanika, d'Eon and Dachsbacher, "Multiple-Scattering Microfacet BSDFs with the Smith
# Model", SIGGRAPH 2016: what single scattering loses, how light is spread over scattering
# orders, where each order goes, at which heights it meets facets, and how single and multiple
# scattering compare. A notebook for Jupyter (`jupytext --to notebook talk.py`); every cell
# leaves arrays, and `SAMPLES` scales their noise. Figures need matplotlib, the arrays only numpy.

# %%
import math
import os

import numpy as np
import smithwalk

SAMPLES = int(os.environ.get("SAMPLES", 200_000))
ALPHAS = np.array([0.1, 0.2, 0.5, 1.0])
COSINES = np.array([1.0, 0.5, 0.2])
FACETS = {
    "conductor": lambda alpha: smithwalk.conductor(alpha=alpha),
    "dielectric": lambda alpha: smithwalk.dielectric(alpha=alpha, eta=1.5),
    "diffuse": lambda alpha: smithwalk.diffuse(alpha=alpha),
}


def plot(draw):
    """A figure where matplotlib is there."""
    try:
        import matplotlib.pyplot as plt
    except ImportError:
        return
    draw(plt)
    plt.show()


# %% [markdown]
# ## The white furnace
#
# Without absorption all light comes back. `furnace[facets]` has the shape (α, cosθ, order):
# the share of the light that leaves after 1, 2, … facets; the last order has the rest.
# `lost` is what single scattering, which ends after the first, takes away.

# %%
furnace, furnace_stderr = {}, {}
for name, material in FACETS.items():
    found = [material(alpha).albedo(COSINES, orders=8, samples=SAMPLES) for alpha in ALPHAS]
    furnace[name] = np.array([albedo.orders for albedo in found])
    # The shares of one walk are 0 or 1.
    furnace_stderr[name] = np.sqrt(furnace[name] * (1 - furnace[name]) / SAMPLES)
    total = np.array([(albedo.reflected + albedo.transmitted)[..., 0] for albedo in found])
    assert np.allclose(total, 1.0, atol=1e-9), "energy is kept"
lost = {name: 1.0 - shares[..., 0] for name, shares in furnace.items()}
for name, share in lost.items():
    print(f"{name}: lost by single scattering at α = 1:", np.round(share[-1], 3), "at cosθ =", COSINES)


# %%
@plot
def _(plt):
    figure, axes = plt.subplots(1, 3, sharey=True, figsize=(12, 3.5))
    for axis, (name, shares) in zip(axes, furnace.items()):
        bottom = np.zeros(len(ALPHAS))
        for order in range(shares.shape[-1]):
            axis.bar(np.arange(len(ALPHAS)), shares[:, 1, order], bottom=bottom, label=f"order {order + 1}")
            bottom += shares[:, 1, order]
        axis.set(title=f"{name}, light from 60°", xticks=np.arange(len(ALPHAS)), xticklabels=ALPHAS, xlabel="α")
    axes[0].set_ylabel("share of the light")
    axes[-1].legend()


# %% [markdown]
# ## Lobes by order
#
# f |cosθ_o| in 1/sr in the plane of incidence, α = 1, light from 60°. `lobes[facets]` has the
# shape (angle, order); negative angles are on the side of the light, beyond ±90° is transmission.

# %%
angles = np.radians(np.concatenate([np.arange(-175, -90, 5), np.arange(-85, 90, 5), np.arange(95, 180, 5)]))
wi = smithwalk.spherical(0.5)
wo = smithwalk.spherical(np.cos(angles), np.where(angles > 0.0, np.pi, 0.0))
lobes, lobes_stderr = {}, {}
for name, material in FACETS.items():
    value, stderr = material(1.0).eval_orders(wi, wo, orders=4, samples=max(SAMPLES // 100, 64))
    lobes[name], lobes_stderr[name] = value[..., 0], stderr[..., 0]


# %%
@plot
def _(plt):
    figure, axes = plt.subplots(1, 3, figsize=(12, 3.5))
    for axis, (name, value) in zip(axes, lobes.items()):
        for order in range(4):
            axis.plot(np.degrees(angles), value[:, order], label=f"order {order + 1}" + (" and more" if order == 3 else ""))
        axis.set(title=name, xlabel="angle from the normal (°)")
    axes[0].set_ylabel("f |cosθ_o| (1/sr)")
    axes[-1].legend()


# %% [markdown]
# ## Heights
#
# With C1 the distribution function of heights, τ = −ln C1 is the optical depth below the top.
# From outside, the first facet is at an exponential depth of the rate 1 + Λ: C1 of the height
# that is met is a power of a uniform number. Started inside at a height of the surface, light
# that goes down adds an exponential depth, light that goes up leaves with the chance C1^Λ or
# meets a facet on its way. Gaussian heights in units of their standard deviation; Beckmann, α = 1.


# %%
def erfc(x):
    return np.array([math.erfc(v) for v in np.ravel(x)]).reshape(np.shape(x))


def smith_lambda(cos, alpha=1.0):
    """Λ of Beckmann for cosθ in (0, 1), Heitz 2014, eq. 53."""
    a = cos / (alpha * math.sqrt(1.0 - cos * cos))
    return math.exp(-a * a) / (2.0 * a * math.sqrt(math.pi)) - 0.5 * math.erfc(a)


GRID = np.linspace(-6.0, 6.0, 20_001)
CDF = 1.0 - 0.5 * erfc(GRID / math.sqrt(2.0))


def height(depth):
    return np.interp(np.exp(-depth), CDF, GRID)


rng = np.random.default_rng(0)
count = max(SAMPLES, 1000)
start = -np.log1p(-rng.random(count))
free = -np.log1p(-rng.random(count))
met = {"outside, normal incidence": height(free)}
met["outside, cosθ 0.1"] = height(free / (1.0 + smith_lambda(0.1)))
met["inside, going down"] = height(start + free / (1.0 + smith_lambda(0.3)))
up = start - free / smith_lambda(0.3)
met["inside, going up"] = height(up[up > 0.0])
bins = np.linspace(-4.0, 4.0, 41)
heights = {name: np.histogram(h, bins, density=True)[0] for name, h in met.items()}
hit = (up > 0.0).mean()
# P(no facet on the way up) = E[C1^Λ] = 1/(1 + Λ) = G1.
assert abs(1.0 - hit - 1.0 / (1.0 + smith_lambda(0.3))) < 5.0 / math.sqrt(count)
means = {name: h.mean() for name, h in met.items()}
print({name: round(float(mean), 3) for name, mean in means.items()})


# %%
@plot
def _(plt):
    for name, density in heights.items():
        plt.stairs(density, bins, label=name)
    plt.xlabel("height (standard deviations)")
    plt.legend()


# %% [markdown]
# ## Single scattering beside all orders
#
# Gold of growing roughness: what is lost, and how colour saturates with the order.

# %%
GOLD = (1.0, 0.71, 0.29)
roughness = np.linspace(0.2, 1.0, 5)
single = np.array([smithwalk.conductor(alpha=r * r).albedo(0.5, orders=2, samples=SAMPLES).orders[0] for r in roughness])
multiple = np.array([smithwalk.conductor(alpha=r * r, color=GOLD).albedo(0.5, samples=SAMPLES).reflected for r in roughness])
for r, one, all_orders in zip(roughness, single, multiple):
    print(f"roughness {r:.1f}: single {np.round(one * np.array(GOLD), 3)}, all orders {np.round(all_orders, 3)}")


# %%
@plot
def _(plt):
    for channel, color in enumerate(("red", "green", "blue")):
        plt.plot(roughness, multiple[:, channel], color=color, label="all orders")
        plt.plot(roughness, single * GOLD[channel], "--", color=color, label="single")
    plt.xlabel("roughness √α")
    plt.ylabel("albedo of gold, light from 60°")
    plt.legend()
