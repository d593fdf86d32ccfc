"""Runs the program: ``python -m embrasure render scene.toml``."""

import os
import sys

from embrasure._program import program

path = program()
os.execv(path, [path, *sys.argv[1:]])
