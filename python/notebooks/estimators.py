# ---
# jupyter:
#   jupytext:
#     formats: py:percent
#   kernelspec:
#     display_name: Python 3
#     name: python3
# ---

# %% [markdown]
# # Comparing estimators
#
# Two estimators of one picture have the same mean, and differ in their noise. Here Kajiya's path tracer, which hits lights by chance, is compared with a
# path tracer that samples lights.

# %%
import numpy as np

import embrasure as em

scene = em.load("scenes/cornell-box.toml", size=(96, 96))
reference = em.render(scene, spp=256, seed=100)

# %%
films = {}
for integrator in ["naive", "path"]:
    films[integrator] = em.render(scene, integrator=integrator, spp=64, seed=1, reuse="none")
    found = em.compare(reference, films[integrator])
    print(f"{integrator:6} relMSE {found.rel_mse:.4f}, {films[integrator].seconds:.2f} s, {found.outcome}")

errors = {name: em.compare(reference, film).rel_mse for name, film in films.items()}
assert errors["path"] < errors["naive"]

# %% [markdown]
# The error falls over time, so estimators are compared by the product of error and time. This
# product is the inverse of the efficiency.

# %%
for name, film in films.items():
    print(f"{name:6} relMSE · seconds = {errors[name] * film.seconds:.5f}")

# %% [markdown]
# ## Is it the same picture?
#
# `em.compare` tests if two films differ by more than their noise. It detects missing light even at a small image size.

# %%
dim = em.render(scene, spp=64, seed=2, max_depth=2)
for name, film in {"path": films["path"], "two bounces": dim}.items():
    found = em.compare(reference, film)
    print(f"{name:12} {found.outcome}, p = {found.p:.2g}, mean off by {100 * np.mean(found.facts['relative_bias']):.1f} %")
assert em.compare(reference, films["path"]).outcome == "equal within noise"
assert em.compare(reference, dim).outcome == "differs"

# %% [markdown]
# ## Convergence
#
# The root mean square error of independent samples falls as N^(-1/2). The error of correlated points falls faster for smooth pictures.

# %%
for name in ["independent", "sobol"]:
    errors_of = []
    counts = []
    for film in em.progressive(scene, spp=64, sampler=name, reuse="none", seed=3):
        errors_of.append(np.sqrt(((film["rgb"] - reference["rgb"]) ** 2).mean()))
        counts.append(film.samples.max())
    slope = np.polyfit(np.log(counts), np.log(errors_of), 1)[0]
    print(f"{name:12} falls as N^{slope:.2f}")
    assert -1.2 < slope < -0.3
