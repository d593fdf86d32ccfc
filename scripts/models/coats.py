"""Seven balls of one shape in a studio: coats on paint, metal and cloth."""
from math import cos, pi, sin

from mesh import Mesh

TITLE = "Coats: seven balls on stands in a studio."
BALLS = [("lacquer", -0.94, 0.45), ("gold", 0, 0.55), ("frosted", 0.94, 0.45),
         ("velvet", -1.46, -0.45), ("piano", -0.5, -0.4), ("pearl", 0.5, -0.4), ("copper", 1.46, -0.45)]


def build():
    mesh = Mesh()
    mesh.part("floor")
    steps = 10
    corner = [(-1.6 - 1.4 * sin(0.5 * pi * i / steps), 1.4 - 1.4 * cos(0.5 * pi * i / steps)) for i in range(steps + 1)]
    profile = [(4.0, 0.0)] + corner + [(-3.0, 5.0)]
    mesh.grid([[(-8, y, z), (8, y, z)] for z, y in profile])
    for material, x, z in BALLS:
        mesh.part("stand")
        mesh.lathe([(0.27, 0), (0.28, 0.01), (0.28, 0.035), (0.27, 0.045), (0.15, 0.05), (0.12, 0.075)], 24, (x, 0, z))
        mesh.part(material)
        mesh.ball((x, 0.455, z), 0.39, 38)
    return mesh
