"""Renders a scene of the suite with LuxCore's PATHCPU: SCENE.json SPP SAMPLER SEED OUTPUT.npy.

SAMPLER is SOBOL, RANDOM or METROPOLIS.
"""

import os
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pyluxcore

import suite_scene

path, spp, sampler, seed, output = sys.argv[1:]
scene = suite_scene.load(Path(path))
pyluxcore.Init(lambda _: None)


def properties(values: dict) -> "pyluxcore.Properties":
    result = pyluxcore.Properties()
    for key, value in values.items():
        result.Set(pyluxcore.Property(key, value))
    return result


# Left, right, bottom and top of the image, in units of half the field of view. LuxCore's own window
# spans the field of view over the longer side, but our field of view is over the height. The window
# is lowered by a pixel, because LuxCore's images are a pixel too low. For a film position of y in 0
# .. H, LuxCore uses H − 1 − y instead of H − y (PerspectiveCamera::InitRay in its
# src/slg/cameras/perspective.cpp).
aspect, pixel = scene.width / scene.height, 2 / scene.height
window = [-aspect, aspect, -1 - pixel, 1 - pixel]

with tempfile.TemporaryDirectory() as meshes:
    described = {
        "scene.camera.type": "perspective",
        "scene.camera.lookat.orig": scene.origin,
        "scene.camera.lookat.target": scene.target,
        "scene.camera.up": scene.up,
        "scene.camera.fieldofview": scene.fov_y,
        "scene.camera.screenwindow": window,
        "scene.camera.cliphither": 1e-3,
        "scene.camera.clipyon": 1e4,
    }
    for i, part in enumerate(scene.parts):
        path = Path(meshes) / f"{i}.ply"
        suite_scene.write_ply(part, path)
        material, thing = f"scene.materials.m{i}", f"scene.objects.o{i}"
        described |= {
            f"{material}.type": "matte",
            f"{material}.kd": part.kd,
            f"{thing}.ply": str(path),
            f"{thing}.material": f"m{i}",
        }
        if any(part.ke):
            described |= {
                f"{material}.emission": part.ke,
                f"{material}.emission.normalizebycolor": 0,
            }
    stage = pyluxcore.Scene()
    stage.Parse(properties(described))

settings = properties(
    {
        "renderengine.type": "PATHCPU",
        # The seed 0 would depend on the time.
        "renderengine.seed": int(seed) + 1,
        "sampler.type": sampler,
        "film.width": scene.width,
        "film.height": scene.height,
        "film.filter.type": "NONE",
        "film.outputs.0.type": "RGB",
        "film.outputs.0.filename": "unused.exr",
        "film.imagepipelines.0.0.type": "NOP",
        "path.pathdepth.total": scene.MAX_DEPTH + 1,
        "path.pathdepth.diffuse": scene.MAX_DEPTH + 1,
        # With the default of 3, hall is 4 % too bright. With roulette, the MIS weight of a light
        # sample includes the survival probability in the density of the BSDF. The MIS weight of an
        # emitter hit does not include it, so the sum of the weights exceeds 1 (DirectLightSampling
        # and DirectHitFiniteLight in LuxCore's src/slg/engines/pathtracer.cpp). If roulette starts
        # at the tenth bounce, the error is 0.2 %. Without roulette sponza takes three times as
        # long.
        "path.russianroulette.depth": 10,
        "batch.haltspp": int(spp),
    }
)
session = pyluxcore.RenderSession(pyluxcore.RenderConfig(settings, stage))
session.Start()
while not session.HasDone():
    session.UpdateStats()
    time.sleep(0.02)
session.Stop()
pixels = np.empty(scene.width * scene.height * 3, np.float32)
session.GetFilm().GetOutputFloat(pyluxcore.FilmOutputType.RGB, pixels)
np.save(output, pixels.reshape(scene.height, scene.width, 3)[::-1])
# At its exit, the library calls Python's log handler after the interpreter has ended. `os._exit`
# avoids this call.
sys.stdout.flush()
os._exit(0)
