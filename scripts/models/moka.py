"""A moka pot and a cup: a product shot."""
from math import cos, pi

from mesh import Mesh, add, curve, turned

TITLE = "Moka pot and cup, for a product shot."
SIDES = 8


def facet(angle):
    """Radius of a regular octagon with rounded corners, relative to the radius of its corners."""
    part = (angle + pi / SIDES) % (2 * pi / SIDES) - pi / SIDES
    return min(cos(pi / SIDES) / cos(part), 0.985)


def build():
    mesh = Mesh()
    turn = lambda p: turned(p, 66)
    mesh.place = turn
    mesh.part("aluminium")
    lower = curve([(0.049, 0.0), (0.052, 0.003), (0.05, 0.02), (0.0445, 0.062), (0.0435, 0.068)], 2)
    upper = curve([(0.0375, 0.084), (0.0385, 0.088), (0.043, 0.12), (0.0505, 0.166)], 2)
    octagon = 64
    mesh.lathe([(0, 0)] + lower + [(0.0, 0.068)], octagon, squeeze=facet)
    mesh.lathe([(0, 0.084)] + upper + [(0.0492, 0.1665), (0.0, 0.1665)], octagon, squeeze=facet)
    # The collar with its thread, and the valve
    mesh.lathe([(0, 0.066), (0.0455, 0.066), (0.047, 0.0675), (0.047, 0.0705), (0.0455, 0.072), (0.041, 0.073), (0.041, 0.079), (0.0425, 0.08),
                (0.0425, 0.083), (0.041, 0.0845), (0, 0.0845)], 48)
    # The lid, and the spout
    mesh.lathe([(0, 0.166), (0.0515, 0.166), (0.052, 0.168), (0.049, 0.1715), (0.03, 0.18), (0.012, 0.1835), (0, 0.184)], octagon, squeeze=facet)
    mesh.grid([[(-0.014, 0.118, 0.038), (0, 0.112, 0.043), (0.014, 0.118, 0.038)], [(-0.019, 0.145, 0.044), (0, 0.143, 0.056), (0.019, 0.145, 0.044)],
               [(-0.02, 0.1655, 0.045), (0, 0.1675, 0.071), (0.02, 0.1655, 0.045)]])
    mesh.part("brass")
    mesh.place = lambda p: turn(add((p[0], 0, 0), (0, 0.034 + p[2], 0.0455 + p[1])))
    mesh.lathe([(0, 0), (0.0058, 0), (0.0058, 0.003), (0.004, 0.004), (0.004, 0.007), (0, 0.007)], 24)
    mesh.place = turn
    mesh.part("bakelite")
    mesh.lathe(curve([(0.006, 0.1835), (0.0055, 0.188), (0.0095, 0.196), (0.0105, 0.203), (0.007, 0.2095)], 3) + [(0, 0.211)], 32)
    handle = curve([(0, 0.158, -0.046), (0, 0.163, -0.068), (0, 0.155, -0.088), (0, 0.12, -0.096), (0, 0.082, -0.101), (0, 0.066, -0.104)], 5)
    mesh.place = lambda p: turn((p[0] * 1.25, p[1], p[2]))
    mesh.tube(handle, [0.0072 + 0.0022 * min(1, i / 8) for i in range(len(handle))], 14)
    mesh.place = lambda p: add(p, (0.118, 0, 0.045))
    mesh.part("porcelain")
    mesh.lathe([(0, 0.003), (0.022, 0.003), (0.03, 0.0), (0.033, 0.001), (0.05, 0.0085), (0.0585, 0.0125), (0.0585, 0.014), (0.048, 0.0108), (0.03, 0.006), (0, 0.006)], 48)
    cup = curve([(0.0165, 0.0062), (0.018, 0.0075), (0.019, 0.01), (0.0265, 0.02), (0.031, 0.04), (0.0325, 0.056)], 3)
    hollow = curve([(0.031, 0.0562), (0.0293, 0.04), (0.025, 0.0215), (0.015, 0.0125)], 3)
    mesh.lathe([(0, 0.0062)] + cup + [(0.0319, 0.0568)] + hollow + [(0, 0.012)], 48)
    mesh.tube([turned(p, -35) for p in curve([(0.0305, 0.047, 0), (0.041, 0.0485, 0), (0.047, 0.039, 0), (0.0415, 0.028, 0), (0.029, 0.0255, 0)], 5)], 0.0026, 10)
    mesh.part("coffee")
    mesh.lathe([(0.0298, 0.045), (0.0, 0.045)], 48)
    mesh.place = lambda p: p
    mesh.part("beans")
    for x, z, angle in [(-0.085, 0.075, 20), (-0.062, 0.092, 100), (-0.098, 0.098, 300), (0.035, 0.115, 60), (-0.02, 0.108, 200), (0.182, 0.06, 10), (0.012, 0.092, 330)]:
        mesh.place = lambda p: add(turned((p[0] * 1.5, max(p[1], -0.0008) * 0.9, p[2]), angle), (x, 0.0008, z))
        mesh.ball((0, 0, 0), 0.0042, 14)
    return mesh
