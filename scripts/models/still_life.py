"""A wine glass, fruit in a copper bowl, a candlestick and a jug on a table beside a window."""
from math import cos, pi, sin

from mesh import Mesh, add, curve, turned

TITLE = "Still life: glass, copper, brass, fruit and glazed clay on a table."


def fruit(mesh, profile, at, tilt, turn, count, wobble):
    """A lathed fruit with a stalk, tilted about x and rotated about y, in degrees."""
    c, s = cos(tilt * pi / 180), sin(tilt * pi / 180)
    mesh.place = lambda p: add(turned((p[0], c * p[1] - s * p[2], s * p[1] + c * p[2]), turn), at)
    mesh.lathe(profile, count, squeeze=lambda a: 1 + wobble * sin(3 * a + 1) + 0.5 * wobble * sin(5 * a))
    top = max(h for _, h in profile)
    mesh.part("stalk")
    mesh.tube([(0, top - 0.006, 0), (0.001, top + 0.004, 0), (0.004, top + 0.014, 0)], [0.0016, 0.0012, 0.0018], 6)
    mesh.place = lambda p: p


def build():
    mesh = Mesh()
    mesh.part("table")
    for i in range(5):
        z = -0.42 + 0.19 * i
        mesh.box((-1.1, -0.04, z), (1.1, 0, z + 0.188), uv=0.8)
    mesh.part("wall")
    mesh.polygon([(-3, -1, -0.75), (3, -1, -0.75), (3, 2.5, -0.75), (-3, 2.5, -0.75)])

    # A wine glass: one closed body, outside up and inside down, with wine that does not touch it.
    glass = curve([(0.036, 0.0), (0.0362, 0.0016), (0.02, 0.0042), (0.0055, 0.0095), (0.0036, 0.03), (0.0036, 0.07), (0.008, 0.088), (0.027, 0.104),
                   (0.0395, 0.13), (0.0405, 0.155), (0.0365, 0.187), (0.0325, 0.212)], 2)
    inside = curve([(0.0316, 0.212), (0.0356, 0.187), (0.0396, 0.155), (0.0386, 0.13), (0.0262, 0.105), (0.01, 0.0945)], 2)
    mesh.part("glass")
    mesh.lathe([(0, 0)] + glass + [(0.0321, 0.2126)] + inside + [(0, 0.0925)], 36, (-0.155, 0.0002, 0.09))
    mesh.part("wine")
    wine = [(0, 0.0929), (0.0096, 0.0948)] + [(r - 0.0003, h) for r, h in reversed(inside[4:-1])]
    mesh.lathe([(r, h) for r, h in wine if h < 0.15] + [(0.0391, 0.1485), (0.0384, 0.1478), (0, 0.1478)], 36, (-0.155, 0.0002, 0.09))

    mesh.part("copper")
    bowl = curve([(0.045, 0.0), (0.05, 0.004), (0.043, 0.016), (0.062, 0.026), (0.106, 0.052), (0.126, 0.088), (0.137, 0.097)], 3)
    hollow = curve([(0.1365, 0.0985), (0.1245, 0.0895), (0.104, 0.0545), (0.06, 0.0285)], 2)
    mesh.lathe([(0, 0.002)] + bowl + hollow + [(0, 0.026)], 40, (0.1, 0, -0.03))

    orange = [(0.038 * sin(pi * i / 12) if 0 < i < 12 else 0, -0.036 * cos(pi * i / 12)) for i in range(13)]
    pear = [(0, -0.03)] + curve([(0.012, -0.031), (0.034, -0.016), (0.0385, 0.008), (0.029, 0.034), (0.018, 0.052), (0.012, 0.064), (0.004, 0.069)], 2) + [(0, 0.068)]
    apple = [(0, -0.026)] + curve([(0.012, -0.032), (0.034, -0.02), (0.041, 0.004), (0.033, 0.026), (0.015, 0.033), (0.006, 0.029)], 2) + [(0, 0.024)]
    for material, profile, at, tilt, turn, count, wobble in [
            ("orange", orange, (0.052, 0.087, -0.005), 20, 40, 22, 0.006), ("orange", orange, (0.115, 0.083, 0.036), -25, 10, 22, 0.006),
            ("apple", apple, (0.16, 0.094, -0.03), 14, -60, 22, 0.014), ("apple", apple, (0.088, 0.092, -0.086), -12, 20, 22, 0.014),
            ("pear", pear, (0.108, 0.137, -0.018), 24, -70, 22, 0.012),
            ("pear", pear, (-0.028, 0.036, 0.135), 84, 62, 28, 0.012), ("orange", orange, (0.262, 0.0362, 0.1), 40, 150, 22, 0.006)]:
        mesh.part(material)
        fruit(mesh, profile, at, tilt, turn, count, wobble)

    mesh.part("brass")
    stick = curve([(0.056, 0.0), (0.057, 0.006), (0.046, 0.012), (0.02, 0.022), (0.011, 0.04), (0.018, 0.052), (0.009, 0.066), (0.0075, 0.12), (0.016, 0.136),
                   (0.009, 0.15), (0.014, 0.166), (0.03, 0.176), (0.031, 0.18), (0.016, 0.181), (0.0155, 0.2), (0.0125, 0.2)], 2)
    mesh.lathe([(0, 0)] + stick + [(0, 0.199)], 32, (-0.25, 0, -0.13))
    mesh.part("wax")
    mesh.lathe([(0, 0.19), (0.0118, 0.19), (0.0117, 0.31), (0.0105, 0.3135), (0.005, 0.312), (0, 0.311)], 20, (-0.25, 0, -0.13))
    mesh.part("stalk")
    mesh.tube([(-0.25, 0.31, -0.13), (-0.2495, 0.318, -0.13), (-0.248, 0.323, -0.1295)], 0.0009, 5)

    mesh.part("clay")
    jug = curve([(0.047, 0.0), (0.05, 0.004), (0.066, 0.05), (0.074, 0.1), (0.06, 0.15), (0.04, 0.185), (0.039, 0.21), (0.047, 0.238)], 2)
    mouth = curve([(0.044, 0.239), (0.036, 0.21), (0.037, 0.186)], 2)
    mesh.place = lambda p: add(turned(p, 15), (0.285, 0, -0.19))
    mesh.lathe([(0, 0)] + jug + mouth + [(0, 0.12)], 34)
    mesh.tube(curve([(0.04, 0.222, 0), (0.075, 0.235, 0), (0.105, 0.2, 0), (0.1, 0.15, 0), (0.066, 0.122, 0)], 4), 0.0075, 10)
    mesh.place = lambda p: p
    return mesh
