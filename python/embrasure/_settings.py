"""Settings as flags of ``embrasure render``, and keys of scene files as TOML."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Union

from numpy.typing import ArrayLike

#: Values that numpy can convert to an array. Lists of lists may mix integers and floats.
Array = Union[ArrayLike, Sequence[Any]]

#: Settings that may be given several times with different values.
REPEATED = ("material", "texture_dir")


def plain(value: Any) -> Any:
    """Converts numpy values to numbers, strings, lists and dictionaries of Python."""
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if isinstance(value, Mapping):
        return {str(key): plain(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(inner) for inner in value]
    return value


def toml(value: Any) -> str:
    """A value as TOML on one line.

    Paths become absolute, because paths in scene files are relative to the file.

    Raises:
        TypeError: TOML does not support the value.
    """
    if isinstance(value, os.PathLike):
        value = os.path.abspath(value)
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(toml, value)) + "]"
    if isinstance(value, Mapping):
        pairs = (f"{toml_key(str(key))} = {toml(inner)}" for key, inner in value.items() if inner is not None)
        return "{ " + ", ".join(pairs) + " }"
    raise TypeError(f"{value!r}: a number, a string, a list or a dictionary is expected")


def toml_key(name: str) -> str:
    """A name as part of a TOML key."""
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else toml(name)


def keys(values: Mapping[str, Any]) -> list[str]:
    """Keys of a scene file, each ``KEY=VALUE``. Keys may have dots, and values may be dictionaries."""
    return [f"{key}={toml(value)}" for key, value in values.items() if value is not None]


def flags(settings: Mapping[str, Any]) -> list[str]:
    """Settings as flags. ``None`` values are left out."""
    return [flag for name, value in settings.items() if value is not None for flag in _flags(name, plain(value))]


def _flags(name: str, value: Any) -> Iterable[str]:
    flag = "--" + name.replace("_", "-")
    is_text = isinstance(value, str)
    if name == "ground":
        return ["--ground" if value else "--no-ground"]
    if name == "denoise" and value is False:
        return ["--denoise=off"]
    if isinstance(value, bool):
        return [flag] if value else []
    if name == "material" and isinstance(value, dict):
        return [f"{flag}={patch}" for patch in _patches(value)]
    if name in REPEATED:
        return [f"{flag}={one}" for one in ([value] if is_text else value)]
    if name == "size" and isinstance(value, list):
        return [f"{flag}={'x'.join(map(str, value))}"]
    if name == "samples":
        if isinstance(value, range):
            if value.step != 1 and len(value) > 1:
                raise ValueError(f"samples: a range of step 1 is expected, not {value}")
            value = [value.start, value.start + len(value)]
        if isinstance(value, list):
            value = "..".join(map(str, value))
    if name == "time_limit" and not is_text:
        value = f"{value}s"
    if isinstance(value, list):
        value = ",".join(map(str, value))
    return [f"{flag}={value}"]


def _patches(materials: Mapping[str, Any]) -> Iterable[str]:
    for glob, value in materials.items():
        if isinstance(value, Mapping):
            yield from (f'"{glob}".{key}={toml(inner)}' for key, inner in value.items())
        else:
            yield f"{glob}={toml(value)}"
