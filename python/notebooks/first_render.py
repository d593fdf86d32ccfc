# ---
# jupyter:
#   jupytext:
#     formats: py:percent
#   kernelspec:
#     display_name: Python 3
#     name: python3
# ---

# %% [markdown]
# # First render
#
# A scene file, a film, and its channels. Run it in a folder that has `scenes/`, such as the clone. jupytext opens this file as a notebook.

# %%
import numpy as np

import embrasure as em

scene = em.load("scenes/cornell-box.toml", size=(128, 128))
film = em.render(scene, spp=16)
film  # a notebook shows the picture

# %% [markdown]
# The film has more than the picture: albedo, normals, distance, and the variance of each pixel. All are float32 arrays, linear, with row 0 at the top.

# %%
print(film.layers)
rgb, normals, distance = film["rgb"], film["N"], film["Z"]
print(rgb.shape, normals.shape, distance.shape)
print("mean radiance", rgb.mean(axis=(0, 1)))

# %% [markdown]
# The variance estimates the error of each pixel. Samples of `sobol` fill each other's gaps, so the true error is smaller.

# %%
deviation = np.sqrt(film.variance).mean()
better = em.render(scene, spp=32)
difference = np.sqrt(((film["rgb"] - better["rgb"]) ** 2).mean())
print(f"standard deviation by the film {deviation:.4f}, difference from 32 samples {difference:.4f}")
assert difference < 3 * deviation

# %% [markdown]
# `progressive` yields films during the render; `develop` makes 8-bit pixels for a display; `save` writes all channels.

# %%
for film in em.progressive(scene, spp=32):
    print(int(film.samples.max()), "samples,", f"{film.seconds:.2f} s")

shown = film.develop(tone="agx", exposure=0.5, denoise="atrous")
film.save("box.exr")
film.save("box.png", tone="agx", exposure=0.5)
assert shown.dtype == np.uint8 and em.read("box.exr")["rgb"].tobytes() == film["rgb"].tobytes()

# %% [markdown]
# A scene may also be made from arrays: here waves under a sky with a sphere of glass, made in numpy.

# %%
x, z = np.meshgrid(np.linspace(-3, 3, 120), np.linspace(-3, 3, 120))
radius = np.hypot(x, z)
waves = np.stack([x, 0.08 * np.cos(9 * radius) * np.exp(-0.6 * radius), z], axis=-1).reshape(-1, 3)
index = np.arange(120 * 120).reshape(120, 120)
quads = np.stack([index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]], axis=-1).reshape(-1, 4)

made = em.Scene(size=(150, 100), spp=8)
made.add_mesh(waves, quads, material=em.Material(diffuse=[0.02, 0.1, 0.12], model="ggx", specular=[0.4, 0.4, 0.4], roughness=0.2))
made.add_light("sky", sun=[120, 35])
made.camera = em.Camera(position=[0, 1.6, 4.5], look_at=[0, 0, 0], vertical_fov=40)
water = em.render(made, exposure="auto", tone="agx")
water
