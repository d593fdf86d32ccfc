"""Renders a scene of the suite with Mitsuba 3: SCENE.json SPP SAMPLER SEED OUTPUT.npy"""

import sys
import tempfile
from pathlib import Path

import mitsuba as mi
import numpy as np

import suite_scene

path, spp, sampler, seed, output = sys.argv[1:]
mi.set_variant("llvm_ad_rgb")
scene = suite_scene.load(Path(path))
description = {
    "type": "scene",
    "integrator": {"type": "path", "max_depth": scene.MAX_DEPTH + 1},
    "sensor": {
        "type": "perspective",
        "fov": scene.fov_y,
        "fov_axis": "y",
        "near_clip": 1e-3,
        "far_clip": 1e4,
        "to_world": mi.ScalarTransform4f().look_at(origin=scene.origin, target=scene.target, up=scene.up),
        "film": {
            "type": "hdrfilm",
            "width": scene.width,
            "height": scene.height,
            "rfilter": {"type": "box"},
            "pixel_format": "rgb",
            "component_format": "float32",
        },
        "sampler": {"type": sampler, "sample_count": int(spp)},
    },
}
with tempfile.TemporaryDirectory() as meshes:
    for i, part in enumerate(scene.parts):
        path = Path(meshes) / f"{i}.ply"
        suite_scene.write_ply(part, path)
        bsdf = part.principled or {"type": "diffuse", "reflectance": {"type": "rgb", "value": part.kd}}
        shape = {"type": "ply", "filename": str(path), "face_normals": True, "bsdf": {"type": "twosided", "b": bsdf}}
        if any(part.ke):
            shape["emitter"] = {"type": "area", "radiance": {"type": "rgb", "value": part.ke}}
        description[f"part{i}"] = shape
    image = mi.render(mi.load_dict(description), spp=int(spp), seed=int(seed))
np.save(output, np.array(image, np.float32))
