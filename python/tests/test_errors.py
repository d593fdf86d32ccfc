"""Errors are exceptions with the same text as on the command line."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Callable, Dict, List, Optional, Tuple

import numpy as np
import pytest

import embrasure as em


def test_errors_of_files_have_their_place(tmp_path: Path) -> None:
    scene = tmp_path / "a.toml"
    scene.write_text('version = 1\n[render]\nmax_dept = 3\n[[object]]\nobj = "a.obj"\n')
    with pytest.raises(em.FileError) as caught:
        em.load(scene)
    error = caught.value
    assert str(error).startswith(f"{scene}:3:1: ") and "help: " in str(error) and "max_depth" in str(error)
    assert (error.file, error.line, error.column) == (str(scene), 3, 1) and error.help
    assert isinstance(error, em.Error)

    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 x\nf 1 2 3\n")
    scene.write_text('version = 1\n[[object]]\nobj = "a.obj"\n')
    with pytest.raises(em.FileError, match=r"a\.obj:3:"):
        em.render(em.load(scene), spp=1)
    with pytest.raises(em.FileError, match=r"a\.obj:3:"):
        em.intersect(scene, [[0, 0, 1]], [[0, 0, -1]])
    with pytest.raises(em.FileError, match="no such file"):
        em.load(tmp_path / "none.toml")
    with pytest.raises(em.FileError, match=r"ends in \.toml or \.obj"):
        em.load(tmp_path / "a.txt")
    with pytest.raises(em.FileError, match="no such file"):
        em.read(tmp_path / "none.exr")


def test_settings_that_cannot_be(box: Path, tmp_path: Path) -> None:
    cases: List[Tuple[Dict[str, Any], str]] = [
        ({"spp": 0}, "--spp 0\n  help: "),
        ({"spp": -1}, "--spp -1"),
        ({"integrator": "pth"}, "did you mean path"),
        ({"max_dept": 3}, "--max-depth"),
        ({"output": "a.exr"}, "only the command line"),
        ({"crop": (0, 0, 999, 9)}, "crop"),
        ({"noise": 0.1, "spp": 3}, "spp"),
        ({"material": {"white.colour": 1}}, "colour"),
    ]
    for settings, words in cases:
        with pytest.raises(em.SettingError) as caught:
            em.render(box, **{"size": (8, 8), **settings})
        assert words in str(caught.value), settings
    with pytest.raises(em.SettingError, match="--threads"):
        em.load(box, threads="many")
    with pytest.raises(em.SettingError, match="render.sampes=3"):
        em.load(box, {"render.sampes": 3})
    with pytest.raises(em.SettingError, match="choose among zsobol"):
        em.sampler("sobel")
    with pytest.raises(ValueError, match="samples: a range of step 1"):
        em.render(box, spp=8, size=(8, 8), samples=range(0, 8, 2))
    film = em.render(box, spp=1, size=(8, 8))
    with pytest.raises(em.FileError, match=r"unknown image format"):
        film.save(tmp_path / "a.gif")
    with pytest.raises(em.FileError, match="does not exist"):
        film.save(tmp_path / "none" / "a.exr")
    with pytest.raises(em.Error, match="time_limit"):
        em.render(box, spp=1, size=(2000, 2000), time_limit=1e-6)


def test_documented_names_are_those_of_the_program(box: Path) -> None:
    film = em.render(box, spp=1, size=(8, 8))
    places: List[Tuple[Callable[[], object], Optional[str]]] = [
        (lambda: em.sampler("sobel"), em.sampler.__doc__),
        (lambda: film.develop(tone="nosuch"), em.Film.develop.__doc__),
        (lambda: film.develop(denoise="nosuch"), em.Film.develop.__doc__),
    ]
    for wrong, documented in places:
        with pytest.raises(em.SettingError, match="choose among ") as caught:
            wrong()
        names = str(caught.value).split("choose among ")[1].split(", ")
        # `denoise=False` is `off` on the command line.
        names = [name for name in names if name != "off"]
        assert len(names) > 3 and [name for name in names if f"``{name}``" not in str(documented)] == []


def test_arrays_that_make_no_mesh() -> None:
    scene = em.Scene()
    corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    for args, words in [
        (([[0, 0]], [[0, 1, 2]]), "vertices: an array N×3"),
        ((corners, [[0, 1, 3]]), r"face 0 has the corners \[0, 1, 3\], but there are 3"),
        ((corners, [[0, 1, -1]]), "face 0"),
        ((corners, [[0.5, 1, 2]]), "whole numbers"),
        ((corners, [[0, 1, 2]], [[0, 0, 1]]), "normals: 3 rows"),
        ((corners, [[0, 1, 2]], None, [[0, 0, 1]] * 3), "uv: an array N×2"),
        ((7,), "faces: give them"),
        ((7, [[0, 1, 2]]), "vertices: an array N×3 is expected, not a number"),
        ((corners, [[0, 1]]), "whole numbers M×3 or M×4 are expected, not 1×2 of int"),
        ((corners, []), "whole numbers"),
    ]:
        with pytest.raises(ValueError, match=words):
            scene.add_mesh(*args)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match=r"material: a Material or the name of one"):
        scene.add_mesh(corners, [[0, 1, 2]], material={"diffuse": 1})  # type: ignore[arg-type]
    scene.add_mesh(corners, [[0, 1, 2]], name="bad")
    scene.add_mesh([[0, 0, 0], [1, 0, 0], [np.nan, 1, 0]], [[0, 1, 2]], name="worse")
    with pytest.raises(em.FileError, match="object `worse`: vertex 2 is at"):
        em.render(scene, spp=1, size=(8, 8))


def test_keys_of_a_scene_in_code_are_checked() -> None:
    scene = em.Scene()
    scene.add_mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], material=em.Material(difuse=[1, 1, 1]))
    with pytest.raises(em.SettingError, match="diffuse"):
        em.render(scene, spp=1, size=(8, 8))
    scene = em.Scene()
    scene.add_light("point", intensty=3)
    with pytest.raises(em.SettingError, match="intensity"):
        scene.description()
    scene = em.Scene()
    with pytest.raises(TypeError, match="a number, a string"):
        scene.keys["render.samples"] = object()
        scene.description()
    with pytest.raises(ValueError, match="another material"):
        scene.add_mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], material=em.Material("a", diffuse=0.1))
        scene.add_mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], material=em.Material("a", diffuse=0.2))


def test_an_empty_scene_gets_the_default_light() -> None:
    film = em.render(em.Scene(), spp=1, size=(8, 8), position=(0, 0, 1), look_at=(0, 0, 0))
    # A scene without lights gets the default light.
    assert film["rgb"].shape == (8, 8, 3)


def test_warnings_are_those_of_python(tmp_path: Path) -> None:
    obj = tmp_path / "a.obj"
    obj.write_text("usemtl none\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    scene = tmp_path / "a.toml"
    scene.write_text('version = 1\n[[object]]\nobj = "a.obj"\n')
    with pytest.warns(em.SceneWarning, match="material `none` is rendered in a plain grey"):
        film = em.render(scene, spp=1, size=(8, 8))
    assert any("`none`" in text for text in film.warnings)
