# ---
# jupyter:
#   jupytext:
#     formats: py:percent
#   kernelspec:
#     display_name: Python 3
#     name: python3
# ---

# %% [markdown]
# # BSDFs and importance sampling
#
# The scattering of light at a surface is a function of two directions. `em.bsdf` evaluates it on arrays: its value, its samples, and their density.

# %%
import numpy as np

import embrasure as em

material = em.Material(diffuse=[0.2, 0.2, 0.2], model="ggx", specular=[0.6, 0.6, 0.6], roughness=0.35)
surface = em.bsdf(material)
print(surface.lobes)

# %% [markdown]
# The value along the plane of incidence, for a viewer at 45°: the peak is near the mirror direction, at -45°.

# %%
wo = np.array([np.sqrt(0.5), 0, np.sqrt(0.5)])
angles = np.radians(np.linspace(-89, 89, 179))
wi = np.stack([np.sin(angles), np.zeros_like(angles), np.cos(angles)], axis=-1)
values = surface.eval(wo, wi)[:, 0]
peak = np.degrees(angles[values.argmax()])
print(f"peak {values.max():.2f} per steradian at {peak:.0f}°")
assert -70 < peak < -40

# %% [markdown]
# ## The albedo, three ways
#
# The fraction of uniform light that reaches the viewer is the integral of f·cos θ over the hemisphere. An estimator samples directions and averages
# f·cos θ / p, where p is their density. The noise depends only on the density.

# %%
n = 4096
u = em.sampler("independent", seed=1).points(n, 4).astype(np.float64)


def uniform(u: np.ndarray) -> np.ndarray:
    radius = np.sqrt(1 - u[:, 0] ** 2)
    phi = 2 * np.pi * u[:, 1]
    return np.stack([radius * np.cos(phi), radius * np.sin(phi), u[:, 0]], axis=-1)


def cosine(u: np.ndarray) -> np.ndarray:
    radius = np.sqrt(u[:, 0])
    phi = 2 * np.pi * u[:, 1]
    return np.stack([radius * np.cos(phi), radius * np.sin(phi), np.sqrt(1 - u[:, 0])], axis=-1)


estimates = {}
wi = uniform(u)
estimates["uniform"] = surface.eval(wo, wi)[:, 0] * wi[:, 2] * 2 * np.pi
wi = cosine(u)
estimates["cosine"] = surface.eval(wo, wi)[:, 0] * np.pi
estimates["BSDF"] = surface.sample(wo, u[:, :3]).weight[:, 0]

for name, estimate in estimates.items():
    print(f"{name:8} {estimate.mean():.4f} ± {estimate.std() / np.sqrt(n):.4f}")
assert estimates["BSDF"].std() < estimates["cosine"].std() < estimates["uniform"].std()

# %% [markdown]
# ## Test of the density
#
# The density integrates to the probability that a sample is above the surface. In any region, the fraction of samples equals the integral of the density.
# The region of this test is the half of the hemisphere opposite to the viewer.

# %%
drawn = surface.sample(wo, em.sampler("sobol").points(1 << 15, 3))
there = drawn.pdf > 0
behind = (there & (drawn.wi[:, 0] < 0)).mean()
wi = uniform(em.sampler("sobol", seed=2).points(1 << 15, 2).astype(np.float64))
by_density = (surface.pdf(wo, wi) * (wi[:, 0] < 0)).mean() * 2 * np.pi
print(f"samples {behind:.4f}, density {by_density:.4f}")
assert abs(behind - by_density) < 0.01

# %% [markdown]
# ## Better points
#
# Points that fill each other's gaps lower the error further, at the same density. Columns of `points` are well distributed in pairs, so a pair chooses the
# direction, and a third column the lobe.


# %%
def albedo(name: str, seed: int, n: int) -> float:
    points = em.sampler(name, seed).points(n, 3)
    return float(surface.sample(wo, points[:, [2, 0, 1]]).weight[:, 0].mean())


reference = albedo("sobol", 99, 1 << 18)
errors = {}
for name in ["independent", "sobol"]:
    means = [albedo(name, seed, 256) for seed in range(32)]
    errors[name] = np.sqrt(np.mean((np.array(means) - reference) ** 2))
    print(f"{name:12} {errors[name]:.5f} with 256 points")
assert errors["sobol"] < errors["independent"]
