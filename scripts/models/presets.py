"""A ball of each preset, in the order of the table of the guide: three rows, the first at the back."""
from math import cos, pi, sin

from mesh import Mesh

TITLE = "Presets: a ball of each in a studio."
ROWS = ["gold silver copper brass aluminium chrome iron titanium", "stainless-steel brushed-steel glass frosted-glass water plastic rubber ceramic",
        "terracotta varnished-wood car-paint velvet paper cardboard leaf"]


def build():
    mesh = Mesh()
    mesh.part("floor")
    steps = 8
    corner = [(-2.2 - 1.0 * sin(0.5 * pi * i / steps), 1.0 - 1.0 * cos(0.5 * pi * i / steps)) for i in range(steps + 1)]
    mesh.grid([[(-9, y, z), (9, y, z)] for z, y in [(5.0, 0.0)] + corner + [(-3.2, 5.0)]])
    for row, names in enumerate(ROWS):
        names = names.split()
        for i, name in enumerate(names):
            mesh.part(name)
            mesh.ball(((i - 0.5 * (len(names) - 1)) * 1.0, 0.42, 1.4 * (row - 1)), 0.42, 20)
    return mesh
