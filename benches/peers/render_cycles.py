"""Renders a scene of the suite with Cycles: SCENE.json SPP SAMPLER SEED OUTPUT.npy.

SAMPLER is SOBOL or TABULATED_SOBOL, followed by ", own denoiser" if Cycles denoises the picture
with its defaults: Open Image Denoise with albedo and normals. Blender's importer reads the OBJ file
of a room. The JSON file defines its constant sky.
"""

import sys
import tempfile
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix, Vector

import suite_scene

path, spp, sampler, seed, output = sys.argv[1:]
scene = suite_scene.load(Path(path))
bpy.ops.wm.read_factory_settings(use_empty=True)
stage = bpy.context.scene


def surface_of(part: suite_scene.Part, material: bpy.types.Material) -> bpy.types.NodeSocket:
    """Makes the shader that reflects light."""
    if part.principled is None:
        diffuse = material.node_tree.nodes.new("ShaderNodeBsdfDiffuse")
        diffuse.inputs["Color"].default_value = [*part.kd, 1]
        return diffuse.outputs[0]
    principled = material.node_tree.nodes.new("ShaderNodeBsdfPrincipled")
    principled.inputs["Base Color"].default_value = [*part.principled["base_color"]["value"], 1]
    principled.inputs["Roughness"].default_value = part.principled["roughness"]
    principled.inputs["Metallic"].default_value = part.principled["metallic"]
    # Mitsuba's specular, like Blender's level, is 0.5 for this index.
    principled.inputs["IOR"].default_value = 1.5
    return principled.outputs[0]


def add(name: str, part: suite_scene.Part) -> None:
    """Adds the triangles of one material."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(part.vertices.tolist(), [], part.triangles.tolist())
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    surface = surface_of(part, material)
    if any(part.ke):
        # Cycles emits on both sides, the other renderers on the front.
        emission, mix, both = (nodes.new(f"ShaderNode{n}") for n in ("Emission", "MixShader", "AddShader"))
        strength = max(part.ke)
        emission.inputs["Color"].default_value = [*(k / strength for k in part.ke), 1]
        emission.inputs["Strength"].default_value = strength
        links.new(nodes.new("ShaderNodeNewGeometry").outputs["Backfacing"], mix.inputs[0])
        links.new(emission.outputs[0], mix.inputs[1])
        links.new(surface, both.inputs[0])
        links.new(mix.outputs[0], both.inputs[1])
        surface = both.outputs[0]
    links.new(surface, nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    mesh.materials.append(material)
    stage.collection.objects.link(bpy.data.objects.new(name, mesh))


if scene.is_room:
    # With these axes, the importer keeps the coordinates of the file.
    bpy.ops.wm.obj_import(filepath=str(scene.obj), forward_axis="Y", up_axis="Z")
    if scene.sky:
        stage.world = bpy.data.worlds.new("world")
        stage.world.use_nodes = True
        stage.world.node_tree.nodes["Background"].inputs["Color"].default_value = [*scene.sky, 1]
for i, part in enumerate(scene.parts):
    add(f"part{i}", part)

camera = bpy.data.cameras.new("camera")
camera.sensor_fit = "VERTICAL"
camera.angle_y = np.radians(scene.fov_y)
camera.clip_start, camera.clip_end = 1e-3, 1e4
eye = bpy.data.objects.new("camera", camera)
back = (Vector(scene.origin) - Vector(scene.target)).normalized()
right = Vector(scene.up).cross(back).normalized()
eye.matrix_world = Matrix.Translation(scene.origin) @ Matrix((right, back.cross(right), back)).transposed().to_4x4()
stage.collection.objects.link(eye)
stage.camera = eye

render, cycles = stage.render, stage.cycles
render.engine = "CYCLES"
render.resolution_x, render.resolution_y, render.resolution_percentage = scene.width, scene.height, 100
render.image_settings.file_format = "OPEN_EXR"
render.image_settings.color_depth = "32"
cycles.device = "CPU"
cycles.samples = int(spp)
cycles.seed = int(seed)
cycles.sampling_pattern = sampler.removesuffix(", own denoiser")
cycles.use_adaptive_sampling = False
cycles.use_denoising = sampler.endswith(", own denoiser")
cycles.pixel_filter_type = "BOX"
cycles.filter_width = 1.0
cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = scene.MAX_DEPTH
cycles.transmission_bounces = cycles.transparent_max_bounces = scene.MAX_DEPTH
cycles.caustics_reflective = cycles.caustics_refractive = True
cycles.blur_glossy = 0.0

with tempfile.TemporaryDirectory() as temporary:
    render.filepath = str(Path(temporary) / "x.exr")
    bpy.ops.render.render(write_still=True)
    picture = bpy.data.images.load(render.filepath)
    picture.colorspace_settings.is_data = True
    pixels = np.empty(scene.width * scene.height * 4, np.float32)
    picture.pixels.foreach_get(pixels)
np.save(output, pixels.reshape(scene.height, scene.width, 4)[::-1, :, :3])
