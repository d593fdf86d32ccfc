"""An owl whose skin is painted on four tiles (UDIM): body, head, wings, and feet with beak. The scene
file shows it from three sides, as a character sheet does."""
import struct
import zlib
from math import atan2, cos, floor, hypot, pi, sin

from mesh import Mesh, curve, turned

TITLE = "Owl: a figure with texture coordinates on four tiles (UDIM)."
BROWN, DARK, CREAM, ORANGE, BLACK = (104, 66, 38), (58, 34, 20), (236, 212, 166), (232, 132, 28), (18, 14, 12)
SIZE = 256


def surface(mesh, tile, point, columns, rows, low=(0.0, 0.0), high=(1.0, 1.0)):
    """Adds a closed surface. `point(u, v)` has u to the right around the surface, seen from outside,
    and v upwards; the rows at v = 0 and v = 1 are poles. Texture coordinates go from `low` to `high` of
    the tile."""
    place = lambda u, v: tuple(t + a + (b - a) * x for t, a, b, x in zip(tile, low, high, (u, v)))
    for k in range(rows):
        for i in range(columns):
            corners = [(i, k), (i + 1, k), (i + 1, k + 1), (i, k + 1)]
            if k == 0:
                corners.pop(1)
            if k == rows - 1:
                corners.pop(-1)
            shares = [(a / columns, b / rows) for a, b in corners]
            points = [point(0.0 if v in (0.0, 1.0) else u % 1.0, v) for u, v in shares]
            # Keep merged points once: two equal corners would make triangles without area
            numbers = [mesh.point(p) for p in points]
            kept = [n for n, number in enumerate(numbers) if number not in numbers[:n]]
            if len(kept) > 2:
                mesh.polygon([points[n] for n in kept], [place(*shares[n]) for n in kept])


def turn_of(u):
    """Direction around +y: the front, +z, is at u = 1/2."""
    return sin(2 * pi * (u - 0.5)), cos(2 * pi * (u - 0.5))


def ellipsoid(at, radii, bend=lambda p: p):
    def point(u, v):
        x, z = turn_of(u)
        r, y = sin(pi * v), -cos(pi * v)
        return tuple(a + b for a, b in zip(at, bend((radii[0] * r * x, radii[1] * y, radii[2] * r * z))))
    return point


def build():
    mesh = Mesh()
    mesh.part("skin", "body")
    outline = curve([(0.0, 0.03), (0.14, 0.04), (0.25, 0.16), (0.275, 0.34), (0.22, 0.54), (0.13, 0.66), (0.0, 0.7)], 3)

    def body(u, v):
        x, z = turn_of(u)
        r, y = outline[round(v * (len(outline) - 1))]
        return (r * x, y, 0.9 * r * z - 0.02)
    surface(mesh, (0, 0), body, 28, len(outline) - 1)
    # The tail leans back
    tail = ellipsoid((0.0, 0.21, -0.25), (0.12, 0.2, 0.035), lambda p: (p[0], 0.87 * p[1] - 0.5 * p[2], 0.5 * p[1] + 0.87 * p[2]))
    surface(mesh, (0, 1), tail, 12, 8)
    mesh.part("skin", "head")
    surface(mesh, (1, 0), ellipsoid((0.0, 0.75, 0.01), (0.27, 0.2, 0.22)), 28, 16)
    for side in (-1, 1):
        # Ears, in the brown of the back of the head
        tuft = ellipsoid((0.17 * side, 0.93, 0.0), (0.045, 0.11, 0.035), lambda p, s=side: (p[0] * (0.13 - p[1]) / 0.16 + 0.3 * s * p[1], p[1], p[2] * (0.13 - p[1]) / 0.16))
        surface(mesh, (1, 0), tuft, 10, 8, (0.02, 0.55), (0.1, 0.7))
        mesh.part("skin", "wing_left" if side > 0 else "wing_right")
        lean = lambda p, s=side: (p[0] * (1.0 + 0.3 * p[1]) - 0.2 * s * p[1] - 0.3 * s * p[2], p[1], p[2] - 0.15 * p[1] - 0.3 * p[1] * p[1])
        surface(mesh, (0, 1), ellipsoid((0.255 * side, 0.36, -0.02), (0.05, 0.26, 0.15), lean), 14, 12)
        mesh.part("skin", "head")
    mesh.part("skin", "beak")
    beak = ellipsoid((0.0, 0.7, 0.225), (0.035, 0.065, 0.045), lambda p: (p[0] * (0.9 + 6 * p[1]), p[1], p[2] * (1.0 + 5 * p[1]) - 0.2 * p[1]))
    surface(mesh, (1, 1), beak, 12, 8, (0.05, 0.1), (0.45, 0.9))
    mesh.part("skin", "feet")
    for side in (-1, 1):
        for angle in (-28, 0, 28):
            bend = lambda p, a=angle: turned(p, a)
            toe = ellipsoid((0.1 * side + 0.09 * sin(angle * pi / 180), 0.025, 0.04 + 0.1 * cos(angle * pi / 180)), (0.026, 0.025, 0.085), bend)
            surface(mesh, (1, 1), toe, 10, 8, (0.05, 0.1), (0.45, 0.9))
    return mesh


def mix(a, b, share):
    share = min(max(share, 0.0), 1.0)
    return tuple(x + (y - x) * share for x, y in zip(a, b))


def feathers(u, v, across, along):
    """Position in a feather of a grid of rows that overlap like tiles: 1 at its tip, 0 where the next
    one begins. Also returns a number for each feather."""
    row = floor(v * along)
    best, name = 0.0, 0
    for k in (row, row + 1):
        x = u * across + 0.5 * (k % 2)
        column = floor(x)
        tip = (k + 0.0) / along
        dx, dy = 2 * (x - column) - 1, (v - tip) * along
        # A feather hangs from its row down to a round tip
        depth = dy + 0.85 * (1 - abs(dx) ** 2.5) ** 0.5 - 0.6
        if depth > 0 and k == row + 1 or k == row and best == 0.0:
            best, name = max(0.0, min(1.0, 1 - abs(depth))), column * 7 + k * 13
    return best, name


def body(u, v):
    back, name = feathers(u, v, 14, 9)
    color = mix(BROWN, DARK, 0.75 * back ** 3 + 0.12 * (name % 3))
    belly = hypot((u - 0.5) / 0.2, (v - 0.5) / 0.42)
    spot, _ = feathers(u, v, 24, 14)
    front = mix(CREAM, BROWN, 0.85 * spot ** 6)
    return mix(front, color, (belly - 0.97) * 30)


def head(u, v):
    back, name = feathers(u, v, 18, 9)
    color = mix(BROWN, DARK, 0.6 * back ** 3 + 0.1 * (name % 3))
    for side in (-1, 1):
        # u spans the circumference, and v spans half of the circumference
        x, y = 2.3 * (u - 0.5 - 0.072 * side), v - 0.5
        r, angle = hypot(x, y), atan2(y, x)
        rays = 0.5 + 0.5 * cos(24 * angle)
        disc = mix(CREAM, BROWN, 0.5 * rays * (r / 0.2) ** 2)
        disc = mix(disc, DARK, (r - 0.185) * 90)
        color = mix(disc, color, (r - 0.2) * 200)
        color = mix(ORANGE, color, (r - 0.095) * 150)
        color = mix(mix(ORANGE, (255, 190, 60), 0.5 + 0.5 * cos(40 * angle)), color, (r - 0.088) * 150)
        color = mix(BLACK, color, (r - 0.058) * 150)
        color = mix((250, 250, 250), color, (hypot(x + 0.022, y - 0.024) - 0.014) * 300)
        brow = abs(y - 0.15 - 0.5 * side * (u - 0.5 - 0.1 * side) * 2)
        color = mix(DARK, color, (max(brow - 0.022, abs(u - 0.5 - 0.1 * side) - 0.1)) * 150)
    return color


def wings(u, v):
    feather, name = feathers(u, v, 10, 8)
    color = mix(BROWN, (150, 104, 62), 0.25 * (name % 4))
    color = mix(color, CREAM, 3 * (feather - 0.72))
    return mix(color, DARK, 6 * (feather - 0.86))


def feet(u, v):
    return mix((214, 120, 30), (250, 176, 70), 0.5 + 0.5 * sin(2 * pi * 9 * v) if u < 0.5 else 0.0)


def write(folder):
    """Writes the four tiles."""
    for number, paint in [(1001, body), (1002, head), (1011, wings), (1012, feet)]:
        rows = []
        for y in range(SIZE):
            row = bytearray([0])
            for x in range(SIZE):
                total = (0.0, 0.0, 0.0)
                for i in (0.25, 0.75):
                    for k in (0.25, 0.75):
                        color = paint((x + i) / SIZE, 1 - (y + k) / SIZE)
                        total = tuple(a + b / 4 for a, b in zip(total, color))
                row += bytes(min(255, max(0, round(c / 4) * 4)) for c in total)
            rows.append(bytes(row))

        def chunk(kind, data):
            return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        header = struct.pack(">IIBBBBB", SIZE, SIZE, 8, 2, 0, 0, 0)
        path = folder / f"owl.{number}.png"
        path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header)
                         + chunk(b"IDAT", zlib.compress(b"".join(rows), 9)) + chunk(b"IEND", b""))
