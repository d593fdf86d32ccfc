"""Runs the program: ``python -m embrasure render scene.toml``."""

import os
import sys

from embrasure import program

path = program()
os.execv(path, [path, *sys.argv[1:]])
