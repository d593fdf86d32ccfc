"""Two apples with vertex colours, like a scan, and no material library."""
from math import atan2, cos, hypot, pi, sin

from mesh import Mesh, curve, turned

TITLE = "Scan: apples with a colour at each vertex (sRGB)."
# Radius and height of the outline, from the lower dent to the upper dent
OUTLINE = [(0.0, 0.06), (0.12, 0.01), (0.3, 0.06), (0.46, 0.32), (0.5, 0.58), (0.42, 0.83), (0.24, 0.93), (0.08, 0.87), (0.0, 0.8)]
SIDES = 56


def between(a, b, share):
    share = min(max(share, 0.0), 1.0)
    return tuple(x + (y - x) * share for x, y in zip(a, b))


def streaks(angle, height):
    """Smooth noise around 0 that varies more along a parallel than along a meridian."""
    return (sin(9 * angle + 2 * height) + sin(23 * angle + 1) + sin(5 * angle - 3 * height + 2)) / 3


def skin(redness):
    """Colour of an apple: yellow below, red above and on its sunny side, green in the upper dent."""
    def color(point):
        x, height, z = point
        angle, radius = atan2(x, z), hypot(x, z)
        red = redness * (0.5 + 0.5 * cos(angle - 0.6)) + 0.7 * height - 0.3 + 0.25 * streaks(angle, height)
        color = between((0.88, 0.77, 0.3), (0.7, 0.09, 0.1), red)
        return between((0.5, 0.55, 0.18), color, radius / 0.22 if height > 0.7 else 1.0)

    return color


def apple(mesh, at, turn, redness):
    mesh.place = lambda p: tuple(a + b for a, b in zip(turned(p, turn), at))
    mesh.color = skin(redness)
    mesh.lathe(curve(OUTLINE, 4), SIDES, squeeze=lambda angle: 1 + 0.025 * cos(5 * angle))
    mesh.color = lambda point: between((0.2, 0.12, 0.06), (0.45, 0.33, 0.2), (point[1] - 0.75) / 0.35)
    mesh.tube([(0.0, 0.78, 0.0), (0.02, 0.95, 0.0), (0.08, 1.1, 0.03)], [0.02, 0.018, 0.026], 8)


def build():
    mesh = Mesh()
    mesh.part(None, "Red")
    apple(mesh, (0.0, 0.0, 0.0), 0, 0.7)
    mesh.part(None, "Yellow")
    apple(mesh, (1.02, 0.0, -0.35), 140, 0.25)
    return mesh
