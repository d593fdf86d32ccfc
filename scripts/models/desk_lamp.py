"""A desk at dusk: a lamp over an open book, a mug of pencils, and a window."""
from math import cos, pi, sin

from mesh import Mesh, add, curve, rounded, turned, unit

TITLE = "Desk lamp: a lamp over an open book, beside a window at dusk."


def lamp(mesh):
    mesh.part("enamel")
    mesh.lathe(rounded((0.1, 0.0), (0.1, 0.026), 0.008), 40, (-0.36, 0, -0.2))
    foot, elbow, head = (-0.36, 0.026, -0.2), (-0.47, 0.34, -0.22), (-0.16, 0.53, -0.12)
    mesh.part("steel")
    for z in (-0.012, 0.012):
        mesh.tube([add(foot, (0, 0, z)), add(elbow, (0, 0, z))], 0.005, 10)
        mesh.tube([add(elbow, (0, 0, z)), add(head, (0, 0, z))], 0.005, 10)
    for joint in (add(foot, (0, 0.012, 0)), elbow, head):
        mesh.tube([add(joint, (0, 0, -0.024)), add(joint, (0, 0, 0.024))], 0.014, 16)
    # The shade is rotated so that it opens towards the book.
    axis = unit((0.28, -1.0, 0.22))
    side = unit((-axis[1], axis[0], 0))
    third = (side[1] * axis[2] - side[2] * axis[1], side[2] * axis[0] - side[0] * axis[2], side[0] * axis[1] - side[1] * axis[0])
    mesh.place = lambda p: add(add(add(head, side, p[0]), axis, -p[1]), third, -p[2])
    mesh.part("enamel")
    outer = curve([(0.088, -0.135), (0.08, -0.1), (0.058, -0.05), (0.04, -0.025), (0.026, -0.012), (0.024, 0.03), (0.016, 0.042)], 3)
    mesh.lathe(outer + [(0, 0.042)], 40)
    mesh.part("inside")
    mesh.lathe([(0, -0.016), (0.024, -0.018), (0.038, -0.028), (0.056, -0.053), (0.0785, -0.101), (0.0875, -0.135), (0.088, -0.135)], 40)
    mesh.part("bulb")
    mesh.lathe([(0, -0.105), (0.03, -0.103), (0.06, -0.098), (0.07, -0.092), (0, -0.085)], 32)
    mesh.place = lambda p: p


def book(mesh):
    mesh.place = lambda p: add(turned(p, 12), (0.06, 0.0, 0.03))
    half, depth = 0.15, 0.21
    mesh.part("cover")
    mesh.box((-half - 0.006, 0, -depth / 2 - 0.005), (half + 0.006, 0.003, depth / 2 + 0.005))
    height = lambda t: 0.006 + 0.02 * min(1, 5 * t) ** 0.6 * (1 - 0.55 * t) * (1 if t > 0 else 0.2)
    ts = [0, 0.01, 0.03, 0.06, 0.1, 0.16, 0.25, 0.4, 0.6, 0.8, 1.0]
    lines = 22
    for sign in (-1, 1):
        mesh.part("paper")
        points = [(sign * half * t, height(t)) for t in ts]
        points.sort()
        mesh.grid([[(x, y, depth / 2), (x, y, -depth / 2)] for x, y in reversed(points)])
        for z, flip in ((depth / 2, 1), (-depth / 2, -1)):
            for (a, b), (c, d) in zip(points, points[1:]):
                face = [(a, 0.003, z), (c, 0.003, z), (c, d, z), (a, b, z)]
                mesh.polygon(face[::flip])
        x, y = max(points, key=lambda p: abs(p[0]))
        mesh.polygon([(x, 0.003, depth / 2), (x, 0.003, -depth / 2), (x, y, -depth / 2), (x, y, depth / 2)][::sign])
        mesh.part("ink")
        for i in range(lines):
            z = -depth / 2 + 0.022 + i * 0.0077
            if (i, sign) in ((0, 1), (9, -1), (15, 1)):
                continue
            last = 0.9 if (i * 7 + sign) % 5 else 0.55
            stops = [0.12, 0.25, 0.4, 0.6, 0.8, last] if last > 0.8 else [0.12, 0.25, 0.4, last]
            if sign < 0:
                stops = [1.02 - t for t in stops][::-1] if last > 0.8 else [0.92 - t * 0.9 for t in stops][::-1]
            def rise(t):
                k = max(j for j in range(len(ts) - 1) if ts[j] <= t)
                f = (t - ts[k]) / (ts[k + 1] - ts[k])
                return height(ts[k]) * (1 - f) + height(ts[k + 1]) * f + 0.0003
            row = [(sign * half * t, rise(t)) for t in sorted({*stops, *(t for t in ts if stops[0] < t < stops[-1])})]
            row.sort()
            # Words have different lengths, with gaps between them.
            for k, ((a, b), (c, d)) in enumerate(zip(row, row[1:])):
                mesh.polygon([(a, b, z + 0.0022), (c - 0.0016, d, z + 0.0022), (c - 0.0016, d, z), (a, b, z)])
    mesh.place = lambda p: p


def things(mesh):
    mesh.part("mug")
    at = (0.33, 0, -0.17)
    profile = [(0.036, 0.0), (0.04, 0.004), (0.04, 0.092), (0.0385, 0.094), (0.037, 0.092), (0.037, 0.01)]
    mesh.lathe([(0, 0)] + profile + [(0, 0.008)], 40, at)
    mesh.tube(curve([(0.365, 0.078, -0.17), (0.392, 0.08, -0.17), (0.402, 0.05, -0.17), (0.39, 0.022, -0.17), (0.366, 0.02, -0.17)], 4), 0.0055, 10)
    for i, (paint, lean, turn, long) in enumerate([("red", 14, 20, 0.175), ("yellow", 10, 140, 0.165), ("green", 16, 250, 0.18), ("blue", 5, 320, 0.17)]):
        way = turned((sin(lean * pi / 180), cos(lean * pi / 180), 0), turn)
        base = add(at, turned((-0.022, 0.012, 0), turn))
        place = lambda t: add(base, way, t)
        mesh.part(paint)
        mesh.tube([place(0), place(long - 0.02)], 0.0038, 6)
        mesh.part("cedar")
        mesh.tube([place(long - 0.02), place(long - 0.004)], [0.0036, 0.0011], 6)
        mesh.part(paint)
        mesh.tube([place(long - 0.004), place(long)], [0.0012, 0.0002], 6)
    mesh.part("yellow")
    mesh.tube([(0.19, 0.004, 0.19), (0.34, 0.004, 0.1)], 0.0038, 6)
    mesh.part("cedar")
    mesh.tube([(0.19, 0.004, 0.19), (0.175, 0.004, 0.199)], [0.0036, 0.0009], 6)
    # A stack of books at the back, and a glass ball on the papers.
    for i, (paint, wide, high, deep, turn) in enumerate([("navy", 0.24, 0.035, 0.17, 4), ("ochre", 0.21, 0.026, 0.16, -6), ("cover", 0.2, 0.03, 0.145, 9)]):
        y = (0, 0.035, 0.061)[i]
        mesh.place = lambda p: add(turned(p, turn), (0.14, y, -0.3))
        for low, part in ((0, paint), (high - 0.003, paint)):
            mesh.part(part)
            mesh.box((-wide / 2, low, -deep / 2), (wide / 2, low + 0.003, deep / 2))
        mesh.part(paint)
        mesh.box((-wide / 2, 0.003, deep / 2 - 0.003), (wide / 2, high - 0.003, deep / 2))
        mesh.part("paper")
        mesh.box((-wide / 2 + 0.004, 0.003, -deep / 2 + 0.004), (wide / 2 - 0.004, high - 0.003, deep / 2 - 0.004))
    mesh.place = lambda p: p
    mesh.part("glass")
    mesh.ball((-0.16, 0.0362, 0.14), 0.036, 40)


def room(mesh):
    mesh.part("desk")
    for i in range(5):
        z = -0.5 + 0.2 * i
        mesh.box((-1.2, -0.03, z), (1.2, 0, z + 0.1985), uv=0.8)
    # The wall has a window with frame and panes.
    left, right, low, high, z = -0.02, 0.62, 0.16, 1.1, -0.62
    mesh.part("wall")
    for a, b, c, d in ((-3, left, -1, 2), (right, 3, -1, 2), (left, right, -1, low), (left, right, high, 2)):
        mesh.polygon([(a, c, z), (b, c, z), (b, d, z), (a, d, z)])
    mesh.part("frame")
    mesh.box((left - 0.03, low - 0.03, z - 0.12), (right + 0.03, low, z + 0.035))
    mesh.box((left - 0.03, high, z - 0.12), (right + 0.03, high + 0.03, z + 0.01))
    for x in (left - 0.03, right):
        mesh.box((x, low, z - 0.12), (x + 0.03, high, z + 0.01))
    mesh.box((0.29, low, z - 0.08), (0.31, high, z - 0.05))
    mesh.box((left, 0.55, z - 0.08), (right, 0.57, z - 0.05))
    mesh.part("pane")
    mesh.polygon([(left, low, z - 0.07), (right, low, z - 0.07), (right, high, z - 0.07), (left, high, z - 0.07)])
    mesh.part("far")
    x = -1.5
    for i, (wide, top) in enumerate([(0.9, 0.52), (0.7, 0.78), (1.2, 0.4), (0.6, 0.95), (0.8, 0.62), (1.0, 0.48), (0.7, 0.85)]):
        mesh.box((x, -3, -6.2 - 0.1 * i), (x + wide, top + 0.15, -5.6 - 0.1 * i))
        mesh.part("lit")
        for k in range(5):
            if (3 * i + 2 * k) % 4 == 0:
                mesh.box((x + 0.14 + 0.13 * k, top - 0.1 - 0.13 * (k % 3), -5.6 - 0.1 * i), (x + 0.19 + 0.13 * k, top - 0.03 - 0.13 * (k % 3), -5.595 - 0.1 * i))
        mesh.part("far")
        x += wide


def build():
    mesh = Mesh()
    room(mesh)
    lamp(mesh)
    book(mesh)
    things(mesh)
    return mesh
