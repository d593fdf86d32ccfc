"""Compares texels of this program with those of OpenImageIO, in files of each format.

    cargo build --release --example texels
    python benches/peers/textures.py target/release/examples/texels

Needs numpy and `pip install OpenImageIO==3.2.2.0`. The files are made here: pictures of noise by
OpenImageIO, and DDS files of random blocks. Prints the share of texels with the same code, and the
largest difference in codes. OpenImageIO multiplies colours by alpha unless it is told not to.
"""

import struct
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

program = sys.argv[1]
folder = Path(tempfile.mkdtemp())
random = np.random.default_rng(1)


def decoded(code):
    return np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)


def encoded(linear):
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 0) ** (1 / 2.4) - 0.055)


def ours(path, kind):
    output = folder / "texels.bin"
    subprocess.run([program, path, kind, output], check=True)
    data = output.read_bytes()
    width, height, channels = struct.unpack("<III", data[:12])
    return np.frombuffer(data, "<f4", offset=12).reshape(height, width, channels).astype(np.float64)


def theirs(path):
    config = oiio.ImageSpec()
    config.attribute("oiio:UnassociatedAlpha", 1)
    file = oiio.ImageInput.open(str(path), config)
    spec = file.spec()
    return file.read_image(0, 0, 0, spec.nchannels, spec.format)


def compare(path, kind="color"):
    expected, got = theirs(path), ours(path, kind)
    if np.issubdtype(expected.dtype, np.integer):
        limit = np.iinfo(expected.dtype).max
        colors = slice(0, got.shape[2] if got.shape[2] % 2 else -1)
        codes = got.copy()
        if kind == "color":
            codes[..., colors] = encoded(got[..., colors])
        codes = np.round(codes * limit)
    else:
        codes = got
    expected = expected.astype(np.float64)
    if expected.shape[2] != codes.shape[2]:
        # The texture may have fewer channels: a grey texture has three equal colours in `expected`,
        # a single channel is read as one value, and an alpha of 1 everywhere is left out.
        count = min(expected.shape[2], codes.shape[2])
        expected, codes = expected[..., :count], codes[..., :count]
    same = np.mean(codes == expected)
    print(f"{path.name:16} {kind:6} {100 * same:6.2f} % of {codes.size} equal, largest difference {np.abs(codes - expected).max():g}")


def write(name, pixels, compression=""):
    path = folder / name
    height, width, channels = pixels.shape
    kinds = {"uint8": "uint8", "uint16": "uint16", "float32": "float", "float16": "half"}
    spec = oiio.ImageSpec(width, height, channels, kinds[str(pixels.dtype)])
    spec.attribute("oiio:UnassociatedAlpha", 1)
    if compression:
        spec.attribute("compression", compression)
    file = oiio.ImageOutput.create(str(path))
    assert file.open(str(path), spec), oiio.geterror()
    assert file.write_image(pixels), file.geterror()
    file.close()
    return path


def dds(name, four, block, size=(62, 31), dxgi=None):
    """A DDS file of random blocks. `dxgi` is the number of its format, in an extended header."""
    count = ((size[0] + 3) // 4) * ((size[1] + 3) // 4)
    data = random.integers(0, 256, count * block, dtype=np.uint8).tobytes()
    header = b"DDS " + struct.pack("<7I", 124, 0x1007, size[1], size[0], 0, 0, 0) + bytes(44)
    header += struct.pack("<2I4s5I", 32, 4, four, 0, 0, 0, 0, 0) + struct.pack("<5I", 0x1000, 0, 0, 0, 0)
    if dxgi is not None:
        header += struct.pack("<5I", dxgi, 3, 0, 1, 0)
    path = folder / name
    path.write_bytes(header + data)
    return path


for channels in (1, 3, 4):
    noise = random.integers(0, 256, (37, 53, channels), dtype=np.uint8)
    wide = random.integers(0, 65536, (64, 64, channels), dtype=np.uint16)
    for name in ("png", "tif"):
        for kind in ("color",) + (("value",) if channels == 1 else ()):
            compare(write(f"8-{channels}.{name}", noise), kind)
            compare(write(f"16-{channels}.{name}", wide), kind)
    if channels > 1:
        compare(write(f"8-{channels}.webp", noise, "lossless"))
    if channels == 3:
        compare(write(f"8-{channels}.gif", noise))
# Lookups at the middles of texels are exact for sizes that are powers of two.
floats = random.random((32, 16, 3), dtype=np.float32)
compare(write("float.tif", floats))
compare(write("half.exr", floats.astype(np.float16)))
for name, four, block in [("bc1", b"DXT1", 8), ("bc2", b"DXT3", 16), ("bc3", b"DXT5", 16)]:
    compare(dds(f"{name}.dds", four, block))
compare(dds("bc6h.dds", b"DX10", 16, (64, 32), dxgi=95))
compare(dds("bc7.dds", b"DX10", 16, dxgi=98))
compare(dds("bc4.dds", b"ATI1", 8), "value")
compare(dds("bc5.dds", b"ATI2", 16), "normal")
