"""Runs the program: ``python -m embrasure render scene.toml``."""

import os
import sys

from embrasure._program import program

try:
    path = program()
except FileNotFoundError as error:
    sys.exit(f"embrasure: {error}")
os.execv(path, [path, *sys.argv[1:]])
