"""Planks of wood as a PNG file of 32 colours: u runs along the grain."""
import random
import struct
import zlib
from math import floor, sin, sqrt

WIDTH, HEIGHT, COLOURS = 512, 512, 32


def smooth_noise(seed):
    values = random.Random(seed)
    table = [[values.random() for _ in range(64)] for _ in range(64)]

    def noise(x, y, period):
        i, k = floor(x), floor(y)
        fx, fy = x - i, y - k
        fx, fy = fx * fx * (3 - 2 * fx), fy * fy * (3 - 2 * fy)
        at = lambda a, b: table[a % period % 64][b % 64]
        return (at(i, k) * (1 - fx) + at(i + 1, k) * fx) * (1 - fy) + (at(i, k + 1) * (1 - fx) + at(i + 1, k + 1) * fx) * fy
    return noise


def write(path):
    """Writes the rings of a trunk, cut lengthwise, with fine pores. The texture tiles."""
    noise = smooth_noise(7)
    rows = []
    for y in range(HEIGHT):
        row = bytearray([0])
        for x in range(WIDTH):
            u, v = x / WIDTH, y / HEIGHT
            bend = noise(4 * u, 8 * v, 4) + 0.5 * noise(8 * u, 16 * v, 8)
            rings = 0.5 + 0.5 * sin(6.28318 * 9 * (v + 0.06 * bend))
            pores = noise(32 * u, 64 * v, 32) * noise(16 * u, 64 * v + 9, 16)
            value = 0.5 * sqrt(rings) + 0.25 * noise(4 * u + 2, 4 * v, 4) + 0.4 * pores
            row.append(min(COLOURS - 1, max(0, int(value * COLOURS * 0.9))))
        rows.append(bytes(row))
    dark, light = (88, 50, 27), (176, 120, 74)
    palette = bytes(round(a + (b - a) * i / (COLOURS - 1)) for i in range(COLOURS) for a, b in zip(light, dark))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    header = struct.pack(">IIBBBBB", WIDTH, HEIGHT, 8, 3, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"PLTE", palette)
                     + chunk(b"IDAT", zlib.compress(b"".join(rows), 9)) + chunk(b"IEND", b""))
