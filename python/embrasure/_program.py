"""Path of the program that the package installs."""

from __future__ import annotations

import os
import sys
import sysconfig


def program() -> str:
    """Path of the program that was installed with this package.

    Raises:
        FileNotFoundError: the package was installed without the program.
    """
    name = "embrasure.exe" if os.name == "nt" else "embrasure"
    packages = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
    # pip install --target puts programs beside the package.
    schemes = [os.path.join(packages, "bin")]
    # PREFIX/lib/pythonX.Y/site-packages belongs to PREFIX/bin, also if another environment imports
    # the package.
    if os.path.basename(packages) in ("site-packages", "dist-packages"):
        schemes.append(os.path.normpath(os.path.join(packages, *[".."] * 3, "bin")))
    schemes += [sysconfig.get_path("scripts"), os.path.join(sys.prefix, "bin")]
    # `get_preferred_scheme` exists since Python 3.10. Older versions have fixed names.
    preferred = getattr(sysconfig, "get_preferred_scheme", None)
    user = preferred("user") if preferred else f"{os.name}_user"
    schemes.append(sysconfig.get_path("scripts", user))
    for folder in schemes:
        path = os.path.join(folder, name)
        if os.path.isfile(path):
            return path
    raise FileNotFoundError(f"no program {name} in {', '.join(dict.fromkeys(schemes))}: install the package again")
