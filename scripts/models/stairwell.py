"""A spiral stair along the wall of a round tower, with tall windows and a skylight."""
from math import cos, pi, sin

from mesh import Mesh

TITLE = "Stairwell: a spiral stair in a round tower, lit through window panes and a skylight."
RADIUS, THICK, HEIGHT = 3.2, 0.4, 11.0
INNER = 1.75
WINDOWS = [(angle, low, low + 2.3) for angle, low in [(-62, 0.9), (-26, 4.0), (10, 4.0), (-62, 4.0), (-62, 7.1), (-26, 7.1), (10, 7.1), (150, 6.6), (118, 3.4)]]
HALF = 9.0


def at(angle, radius, height):
    """Point at `angle` degrees from -z, the view direction, towards +x."""
    return (radius * sin(angle * pi / 180), height, -radius * cos(angle * pi / 180))


def wall(mesh):
    angles = sorted({*range(-180, 180, 6), *(a + s * HALF for a, _, _ in WINDOWS for s in (-1, 1))})
    heights = sorted({0.0, HEIGHT, *(h for _, low, high in WINDOWS for h in (low, high))})
    hole = lambda a, h: any(abs(a - b) < HALF and low < h < high for b, low, high in WINDOWS)
    for a, b in zip(angles, angles[1:] + [180 + angles[0] + 180]):
        for low, high in zip(heights, heights[1:]):
            if not hole((a + b) / 2, (low + high) / 2):
                for radius, first, last in ((RADIUS, a, b), (RADIUS + THICK, b, a)):
                    mesh.polygon([at(first, radius, low), at(last, radius, low), at(last, radius, high), at(first, radius, high)])
    mesh.part("reveal")
    for angle, low, high in WINDOWS:
        a, b, out = angle - HALF, angle + HALF, RADIUS + THICK
        mesh.polygon([at(a, RADIUS, low), at(a, RADIUS, high), at(a, out, high), at(a, out, low)])
        mesh.polygon([at(b, RADIUS, low), at(b, out, low), at(b, out, high), at(b, RADIUS, high)])
        for height in (low, high):
            for first in (a, angle):
                mesh.polygon([at(first, RADIUS, height), at(first, out, height), at(first + HALF, out, height), at(first + HALF, RADIUS, height)])


def bar(mesh, a, b, wide):
    mesh.tube([a, b], wide, 4)


def windows(mesh):
    radius = RADIUS + 0.28
    mesh.part("frame")
    for angle, low, high in WINDOWS:
        for i in range(4):
            a = angle - HALF + 2 * HALF * i / 3
            bar(mesh, at(a, radius, low), at(a, radius, high), 0.035 if i in (0, 3) else 0.02)
        for i in range(6):
            h = low + (high - low) * i / 5
            bar(mesh, at(angle - HALF, radius, h), at(angle, radius, h), 0.035 if i in (0, 5) else 0.02)
            bar(mesh, at(angle, radius, h), at(angle + HALF, radius, h), 0.035 if i in (0, 5) else 0.02)
    mesh.part("pane")
    for angle, low, high in WINDOWS:
        for a in (angle - HALF, angle):
            mesh.polygon([at(a, radius, low), at(a + HALF, radius, low), at(a + HALF, radius, high), at(a, radius, high)])


def stair(mesh):
    count, turn, rise = 58, 11.0, 0.172
    first = -150.0
    end = lambda i: first + turn * i
    for i in range(count):
        a, b, top = end(i), end(i + 1), rise * (i + 1)
        middle, low_a, low_b = (a + b) / 2, rise * i - 0.16, rise * (i + 1) - 0.16
        low_a, low_b = max(low_a, 0.0), max(low_b, 0.0)
        mesh.part("step")
        for p, q in ((a - 0.8, middle), (middle, b)):
            mesh.polygon([at(p, INNER - 0.03, top), at(q, INNER - 0.03, top), at(q, RADIUS, top), at(p, RADIUS, top)])
            mesh.polygon([at(p, RADIUS, top - 0.04), at(q, RADIUS, top - 0.04), at(q, INNER - 0.03, top - 0.04), at(p, INNER - 0.03, top - 0.04)])
            mesh.polygon([at(p, INNER - 0.03, top - 0.04), at(q, INNER - 0.03, top - 0.04), at(q, INNER - 0.03, top), at(p, INNER - 0.03, top)])
        mesh.polygon([at(a - 0.8, INNER - 0.03, top - 0.04), at(a - 0.8, INNER - 0.03, top), at(a - 0.8, RADIUS, top), at(a - 0.8, RADIUS, top - 0.04)])
        mesh.part("plaster")
        mesh.polygon([at(a, INNER, top - rise), at(a, RADIUS, top - rise), at(a, RADIUS, top - 0.04), at(a, INNER, top - 0.04)])
        mesh.polygon([at(a, INNER, low_a), at(b, INNER, low_b), at(b, INNER, top - 0.04), at(a, INNER, top - 0.04)])
        mesh.polygon([at(a, INNER, low_a), at(a, RADIUS, low_a), at(b, RADIUS, low_b), at(b, INNER, low_b)])
    mesh.part("iron")
    for i in range(count):
        for k in (0.2, 0.7):
            a = end(i + k)
            bar(mesh, at(a, INNER + 0.05, rise * (i + 1)), at(a, INNER + 0.05, rise * (i + k) + 1.0), 0.009)
    mesh.part("rail")
    mesh.tube([at(end(i / 2 + 0.2), INNER + 0.05, rise * (i / 2 + 0.2) + 1.0) for i in range(2 * count)], 0.03, 8)


def skylight(mesh):
    ring = 2.2
    mesh.part("plaster")
    for a in range(0, 360, 6):
        mesh.polygon([at(a, RADIUS, HEIGHT), at(a + 6, RADIUS, HEIGHT), at(a + 6, ring, HEIGHT + 0.25), at(a, ring, HEIGHT + 0.25)])
    mesh.part("frame")
    mesh.tube([at(a, ring, HEIGHT + 0.3) for a in range(0, 360, 6)], 0.06, 6, closed=True)
    mesh.tube([at(a, 0.55, HEIGHT + 1.0) for a in range(0, 360, 12)], 0.03, 6, closed=True)
    for a in range(0, 360, 30):
        bar(mesh, at(a, ring, HEIGHT + 0.3), at(a, 0.55, HEIGHT + 1.0), 0.025)
    mesh.part("pane")
    for a in range(0, 360, 30):
        mesh.polygon([at(a, ring, HEIGHT + 0.3), at(a + 30, ring, HEIGHT + 0.3), at(a + 30, 0.55, HEIGHT + 1.0), at(a, 0.55, HEIGHT + 1.0)])
        mesh.polygon([at(a, 0.55, HEIGHT + 1.0), at(a + 30, 0.55, HEIGHT + 1.0), (0, HEIGHT + 1.05, 0)])


def floor(mesh):
    rings = [0, 0.5, 1.0, 1.6, 2.2, 2.8, RADIUS]
    for k, (low, high) in enumerate(zip(rings, rings[1:])):
        for i in range(24):
            mesh.part("dark" if (i + k) % 2 else "pale")
            a, b = 15 * i, 15 * i + 15
            corners = [at(a, high, 0), at(a + 7.5, high, 0), at(b, high, 0), at(b, low, 0), at(a + 7.5, low, 0), at(a, low, 0)]
            mesh.polygon(corners if low else corners[:4])


def build():
    mesh = Mesh()
    mesh.part("plaster")
    wall(mesh)
    windows(mesh)
    stair(mesh)
    skylight(mesh)
    floor(mesh)
    return mesh
