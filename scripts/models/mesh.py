"""Meshes of quads and triangles with a material for each part, written as OBJ. Units are metres, y
is up. The files have no normals: the scene file smooths edges (`smooth` of `[render]`)."""
from math import cos, hypot, pi, sin, sqrt


def add(a, b, scale=1.0):
    return tuple(x + scale * y for x, y in zip(a, b))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def unit(a):
    length = sqrt(sum(x * x for x in a))
    return tuple(x / length for x in a)


def turned(point, degrees):
    """Point rotated about +y, counter-clockwise seen from above."""
    c, s = cos(degrees * pi / 180), sin(degrees * pi / 180)
    return (c * point[0] + s * point[2], point[1], -s * point[0] + c * point[2])


def curve(points, steps):
    """Catmull-Rom spline through points, with `steps` segments between two of them."""
    ends = [points[0]] + list(points) + [points[-1]]
    result = []
    for a, b, c, d in zip(ends, ends[1:], ends[2:], ends[3:]):
        for i in range(steps):
            t = i / steps
            result.append(tuple(
                0.5 * (2 * q + (r - p) * t + (2 * p - 5 * q + 4 * r - s) * t * t + (3 * q - p - 3 * r + s) * t ** 3)
                for p, q, r, s in zip(a, b, c, d)))
    return result + [tuple(points[-1])]


class Mesh:
    def __init__(self):
        self.points, self.numbers, self.uvs, self.parts = [], {}, [], []
        self.names = []
        self.place = lambda p: p
        # sRGB colour of a point before its placement, for meshes with vertex colours
        self.color, self.colors = None, []

    def part(self, material, name=None):
        """Begins a part of one material, with the name `name` in the statement `o`."""
        self.parts.append((material, []))
        self.names.append(name)

    def point(self, p):
        """Number of a point, counted from 1. Points within 0.1 mm are merged."""
        color = self.color and self.color(p)
        p = tuple(round(x, 4) + 0.0 for x in self.place(tuple(p)))
        number = self.numbers.setdefault(p, len(self.points) + 1)
        if number > len(self.points):
            self.points.append(p)
            self.colors.append(color or ())
        return number

    def face(self, corners, uvs=None):
        self.parts[-1][1].append((corners, uvs))

    def polygon(self, points, uvs=None):
        """Adds a flat face, counter-clockwise seen from its front."""
        numbers = None
        if uvs:
            self.uvs += uvs
            numbers = range(len(self.uvs) - len(uvs) + 1, len(self.uvs) + 1)
        self.face([self.point(p) for p in points], numbers)

    def box(self, low, high, uv=None):
        """Adds a box between two corners. With `uv`, the size of the texture in metres, faces get
        texture coordinates with u along the longest side of the box."""
        (a, b, c), (d, e, f) = low, high
        long = max(range(3), key=lambda k: high[k] - low[k])
        for face in ([(a, b, f), (d, b, f), (d, e, f), (a, e, f)], [(d, b, c), (a, b, c), (a, e, c), (d, e, c)],
                     [(d, b, f), (d, b, c), (d, e, c), (d, e, f)], [(a, b, c), (a, b, f), (a, e, f), (a, e, c)],
                     [(a, e, f), (d, e, f), (d, e, c), (a, e, c)], [(a, b, c), (d, b, c), (d, b, f), (a, b, f)]):
            uvs = None
            if uv:
                flat = [k for k in range(3) if len({p[k] for p in face}) == 1][0]
                u, v = sorted((k for k in range(3) if k != flat), key=lambda k: k != long)
                uvs = [(p[u] / uv + 0.37 * low[v], p[v] / uv + 0.61 * low[u]) for p in face]
            self.polygon(face, uvs)

    def grid(self, rows, closed=False):
        """Adds a surface through rows of equally many points. Its front is to the left of the
        direction of a row, with the next row above. Rows of a single point are poles."""
        numbers = [[self.point(p) for p in row] for row in rows]
        for low, high in zip(numbers, numbers[1:]):
            count = max(len(low), len(high))
            for i in range(count if closed else count - 1):
                k = (i + 1) % count
                corners = [low[i % len(low)], low[k % len(low)], high[k % len(high)], high[i % len(high)]]
                self.face([c for n, c in enumerate(corners) if c not in corners[:n]])

    def lathe(self, profile, count, at=(0, 0, 0), squeeze=None):
        """Revolves a profile of (radius, height) about +y. The surface faces outwards where the
        profile goes up. `squeeze(angle)` scales radii."""
        rows = []
        for radius, height in profile:
            row = []
            for i in range(count if radius > 0 else 1):
                angle = 2 * pi * i / count
                r = radius * (squeeze(angle) if squeeze else 1)
                row.append(add((r * sin(angle), height, r * cos(angle)), at))
            rows.append(row)
        self.grid(rows, closed=True)

    def ball(self, at, radius, count):
        half = count // 2
        self.lathe([(radius * sin(pi * i / half) if 0 < i < half else 0, -radius * cos(pi * i / half)) for i in range(half + 1)], count, at)

    def tube(self, path, radius, count=10, closed=False):
        """Adds a round tube along points, with flat ends; `radius` is a number or a list, one per point."""
        radii = radius if isinstance(radius, list) else [radius] * len(path)
        rows, side = [], None
        for i, p in enumerate(path):
            before, after = path[i - 1 if i or closed else 0], path[(i + 1) % len(path) if i + 1 < len(path) or closed else i]
            along = unit(add(after, before, -1))
            if side is None:
                side = unit(cross(along, (0, 1, 0) if abs(along[1]) < 0.9 else (1, 0, 0)))
            side = unit(add(side, along, -sum(a * b for a, b in zip(side, along))))
            up = cross(along, side)
            rows.append([add(add(p, side, radii[i] * cos(2 * pi * k / count)), up, radii[i] * sin(2 * pi * k / count)) for k in range(count)])
        if closed:
            rows.append(rows[0])
        else:
            rows = [[path[0]]] + rows + [[path[-1]]]
        self.grid(rows, closed=True)

    def write(self, path, title):
        """Writes the OBJ file, which uses the MTL file of the same name."""
        with open(path, "w") as file:
            print(f"# {title}\n# Our own model, by scripts/models. MIT OR Apache-2.0.", file=file)
            if any(material for material, _ in self.parts):
                print(f"mtllib {path.stem}.mtl", file=file)
            short = lambda x: f"{round(x, 4) + 0.0:g}"
            for p, color in zip(self.points, self.colors):
                print("v", *map(short, p), *(f"{c:.3g}" for c in color), file=file)
            for p in self.uvs:
                print("vt", *map(short, p), file=file)
            for (material, faces), name in zip(self.parts, self.names):
                if name:
                    print("o", name, file=file)
                if material:
                    print("usemtl", material, file=file)
                for corners, uvs in faces:
                    print("f", *([f"{c}/{t}" for c, t in zip(corners, uvs)] if uvs else corners), file=file)


def rounded(low, high, radius, steps=3):
    """Profile of a round slab with a rounded rim: from the axis at the bottom, around the rim, to the
    axis at the top; `low` and `high` are (radius, height)."""
    (a, bottom), (b, top) = low, high
    arc = lambda x, y, first: [(x + radius * sin(first + 0.5 * pi * i / steps), y - radius * cos(first + 0.5 * pi * i / steps)) for i in range(steps + 1)]
    return [(0, bottom)] + arc(a - radius, bottom + radius, 0) + arc(b - radius, top - radius, 0.5 * pi) + [(0, top)]
