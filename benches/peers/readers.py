"""Reads an EXR file of this program with other programs, and checks their results.

    embrasure render SCENE --aov all -o picture.exr && python benches/peers/readers.py picture.exr

Needs the packages of requirements.txt, and then `pip install --no-deps OpenImageIO==3.2.2.0`, which
requires another numpy but works with the numpy of bpy. Each program is a separate process:

- OpenImageIO reads all channels; they must be bit-identical to the channels that OpenEXR reads;
- Blender's Cryptomatte node finds names in the manifests; its mattes must be the sums of the coverage
  of these names.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np


def channels(path: str) -> tuple[dict, dict]:
    import OpenEXR

    file = OpenEXR.File(path, separate_channels=True)
    return file.header(), {name: channel.pixels for name, channel in file.channels().items()}


def openimageio(path: str, output: str) -> None:
    import OpenImageIO as oiio

    file = oiio.ImageInput.open(path)
    spec = file.spec()
    pixels = file.read_image(0, 0, 0, spec.nchannels, "float")
    np.savez(output, **{name: pixels[:, :, i] for i, name in enumerate(spec.channelnames)})


def blender(path: str, output: str, layer: str, name: str) -> None:
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    stage = bpy.context.scene
    # Render no objects, because the compositor makes the picture
    stage.camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    stage.collection.objects.link(stage.camera)
    stage.render.engine, stage.cycles.samples = "CYCLES", 1
    height, width = channels(path)[1]["R"].shape
    stage.render.resolution_x, stage.render.resolution_y = width, height
    stage.compositing_node_group = tree = bpy.data.node_groups.new("matte", "CompositorNodeTree")
    tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
    matte = tree.nodes.new("CompositorNodeCryptomatteV2")
    matte.source, matte.image = "IMAGE", bpy.data.images.load(path)
    matte.layer_name, matte.matte_id = layer, name
    tree.links.new(matte.outputs["Matte"], tree.nodes.new("NodeGroupOutput").inputs[0])
    stage.render.image_settings.file_format, stage.render.image_settings.color_depth = "OPEN_EXR", "32"
    stage.render.filepath = output
    bpy.ops.render.render(write_still=True)


def told(*args: str) -> None:
    """Runs one of the functions above in a separate process."""
    subprocess.run([sys.executable, __file__, "--by", *args], check=True, stdout=subprocess.DEVNULL)


def main(path: str) -> None:
    header, ours = channels(path)
    # Other programs do not support the additional contents of checkpoints and parts.
    ours = {name: values for name, values in ours.items() if values.dtype != np.uint32}
    with tempfile.TemporaryDirectory() as folder:
        theirs = f"{folder}/oiio.npz"
        told("openimageio", path, theirs)
        read = np.load(theirs)
        wrong = [name for name, values in ours.items() if not np.array_equal(read[name], values.astype(np.float32))]
        assert not wrong, f"OpenImageIO reads other values in {wrong}"
        print(f"OpenImageIO: {len(ours)} channels, the same to the bit")

        for key in [key for key in header if key.startswith("cryptomatte/") and key.endswith("/manifest")]:
            layer = header[key.replace("manifest", "name")]
            for name, id_ in json.loads(header[key]).items():
                share = np.zeros_like(ours["R"])
                for rank in range(3):
                    for id_channel, share_channel in ("RG", "BA"):
                        ids = ours[f"{layer}{rank:02}.{id_channel}"].view(np.uint32)
                        share += np.where(ids == int(id_, 16), ours[f"{layer}{rank:02}.{share_channel}"], 0)
                output = f"{folder}/matte.exr"
                told("blender", path, output, layer, name)
                matte = channels(output)[1]["R"]
                assert np.array_equal(matte, share), f"Blender has another matte for {name} of {layer}"
                print(f"Blender: {layer} {name}, {share.mean():.4%} of the picture, the same to the bit")


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["--by", function, *args]:
            {"openimageio": openimageio, "blender": blender}[function](*args)
        case [path]:
            main(str(Path(path).resolve()))
        case _:
            sys.exit(__doc__)
