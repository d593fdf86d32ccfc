"""Embrasure, a path tracer over Intel Embree: this package brings its command line.

``embrasure`` is in the environment's folder of programs; ``python -m embrasure`` runs the same.
"""

from __future__ import annotations

import os
import sys
import sysconfig

__all__ = ["program"]


def program() -> str:
    """Path of the program that was installed with this package.

    Raises:
        FileNotFoundError: the package was installed without it.
    """
    name = "embrasure.exe" if os.name == "nt" else "embrasure"
    schemes = [sysconfig.get_path("scripts"), os.path.join(sys.prefix, "bin")]
    user = sysconfig.get_preferred_scheme("user")
    schemes.append(sysconfig.get_path("scripts", user))
    # pip install --target puts programs beside the package
    schemes.append(os.path.join(os.path.dirname(os.path.dirname(__file__)), "bin"))
    for folder in schemes:
        path = os.path.join(folder, name)
        if os.path.isfile(path):
            return path
    raise FileNotFoundError(f"no program {name} in {', '.join(schemes)}: install the package again")
