"""Renders: images bit-identical to the command line, channels, and files."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any, Callable, Dict, List

import numpy as np
import OpenEXR
import pytest

import embrasure as em

Command = Callable[..., "subprocess.CompletedProcess[str]"]


def channels(path: Path) -> Dict[str, Any]:
    """Channels of an EXR file, read by an independent reader."""
    with OpenEXR.File(str(path), separate_channels=True) as file:
        return {name: np.array(channel.pixels) for name, channel in file.channels().items()}


#: Attributes that are not compared. Most of them contain the render time, or a digest of the render
#: time.
OF_TIME = ("renderTime", "embrasure.statistics", "embrasure.stateDigest", "channels")


def attributes(path: Path) -> Dict[str, Any]:
    with OpenEXR.File(str(path)) as file:
        return {name: repr(value) for name, value in file.header().items() if name not in OF_TIME}


#: Settings as keywords, and the same settings as flags.
CASES: List[Any] = [
    ({"spp": 3, "size": (40, 32)}, ["--spp", "3", "--size", "40x32"]),
    (
        {"spp": 2, "size": (40, 32), "integrator": "bdpt", "max_depth": 4, "sampler": "halton", "seed": 7},
        "--spp 2 --size 40x32 --integrator bdpt --max-depth 4 --sampler halton --seed 7".split(),
    ),
    (
        {"spp": 2, "size": (40, 32), "crop": (3, 5, 30, 20), "aov": ["P", "uv"], "position": (270.5, 300, -700)},
        "--spp 2 --size 40x32 --crop 3,5,30,20 --aov P,uv --position 270.5,300,-700".split(),
    ),
    (
        {"spp": 2, "size": (24, 24), "denoise": "gaussian", "material": {"white": {"diffuse": [0.1, 0.9, 0.1]}}},
        ["--spp", "2", "--size", "24x24", "--denoise=gaussian", "--material", "white.diffuse=[0.1, 0.9, 0.1]"],
    ),
    ({"spp": 128, "size": (16, 16), "samples": (64, 128)}, "--spp 128 --size 16x16 --samples 64..128".split()),
    ({"spp": 1, "size": (16, 16), "integrator": "sppm", "backend": "brute"}, "--spp 1 --size 16x16 --integrator sppm --backend brute".split()),
]


@pytest.mark.parametrize("settings, flags", CASES)
def test_the_bits_are_those_of_the_command_line(
    settings: Dict[str, Any], flags: List[str], box: Path, command: Command, tmp_path: Path
) -> None:
    film = em.render(em.load(box), **settings)
    theirs, ours = tmp_path / "theirs.exr", tmp_path / "ours.exr"
    done = command("render", box, "-o", theirs, "-o", tmp_path / "theirs.png", *flags)
    assert done.returncode == 0, done.stderr
    expected = channels(theirs)
    assert len(expected) >= 14
    for name in film.channels:
        assert film[name].tobytes() == expected[name].tobytes(), name
    film.save(ours)
    found = channels(ours)
    assert found.keys() == expected.keys()
    for name, pixels in expected.items():
        assert found[name].tobytes() == pixels.tobytes(), name
    assert attributes(ours) == attributes(theirs)
    film.save(tmp_path / "ours.png")
    assert (tmp_path / "ours.png").read_bytes() == (tmp_path / "theirs.png").read_bytes()


def test_a_bare_obj_is_guessed_as_the_command_line_does(command: Command, tmp_path: Path) -> None:
    obj = tmp_path / "tent.obj"
    obj.write_text("v 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 1 0\nf 1 2 3\nf 1 2 4\nf 2 3 4\n")
    film = em.render(obj, spp=2, size=(20, 16))
    theirs = tmp_path / "theirs.exr"
    done = command("render", obj, "--spp", 2, "--size", "20x16", "-o", theirs, "-o", tmp_path / "theirs.png")
    assert done.returncode == 0, done.stderr
    expected = channels(theirs)
    for name in film.channels:
        assert film[name].tobytes() == expected[name].tobytes(), name
    film.save(tmp_path / "ours.png")
    assert (tmp_path / "ours.png").read_bytes() == (tmp_path / "theirs.png").read_bytes()


def test_films_give_arrays(box: Path) -> None:
    film = em.render(box, spp=2, size=(20, 12))
    assert film["rgb"].shape == (12, 20, 3) and film["rgb"].dtype == np.float32
    assert film["albedo"].shape == film["N"].shape == film.variance.shape == (12, 20, 3)
    assert film["Z"].shape == film.samples.shape == (12, 20)
    assert (film.samples == 2).all() and film.complete and film.size == (20, 12)
    assert film.layers == list(film) == ["rgb", "albedo", "N", "Z", "emitted", "variance", "samples"]
    assert (film["N"][..., 1] == film["N.Y"]).all() and (film["rgb"][..., 2] == film["B"]).all()
    lengths = np.linalg.norm(film["N"], axis=2)
    assert lengths.max() < 1.001 and (lengths > 0.99).mean() > 0.3
    assert "Z" in film and "albedo.G" in film and "fog" not in film
    with pytest.raises(KeyError, match="no channel fog: there are rgb, albedo"):
        film["fog"]


def test_films_are_developed(box: Path, tmp_path: Path) -> None:
    film = em.render(box, spp=2, size=(20, 12))
    shown = film.develop()
    assert shown.shape == (12, 20, 3) and shown.dtype == np.uint8
    film.save(tmp_path / "a.png")
    # The PNG file has the pixels of `develop`. `read` decodes them to linear values, so encode the
    # values again.
    linear = em.read(tmp_path / "a.png")["rgb"]
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 1e-9) ** (1 / 2.4) - 0.055)
    assert (np.round(255 * encoded).astype(np.uint8) == shown).all()
    assert film._repr_png_()[:8] == b"\x89PNG\r\n\x1a\n"
    assert film.develop(exposure=2).mean() > shown.mean() > film.develop(exposure=-2).mean()
    assert (film.develop(tone="agx") != shown).any()
    assert (film.develop(denoise="gaussian") != shown).any()
    assert (film.develop(exposure="auto") != shown).any()
    for wrong in ({"tone": "nosuch"}, {"exposure": "bright"}, {"denoise": "nosuch"}):
        with pytest.raises(em.SettingError, match="help: "):
            film.develop(**wrong)


def test_a_transparent_background_gives_alpha() -> None:
    scene = em.Scene(background="transparent", spp=1, size=(16, 16))
    scene.add_mesh([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]])
    scene.camera = em.Camera(position=[0, 0, 4], look_at=[0, 0, 0])
    film = em.render(scene)
    assert film["A"].min() == 0 and film["A"].max() == 1
    assert film.develop().shape == (16, 16, 4)


def test_progressive_films_end_with_the_render(box: Path) -> None:
    films = list(em.progressive(box, spp=6, size=(24, 16)))
    assert [film.samples.max() for film in films] == [1, 2, 4, 6]
    assert all((film.samples == film.samples.max()).all() for film in films)
    whole = em.render(box, spp=6, size=(24, 16))
    assert films[-1]["rgb"].tobytes() == whole["rgb"].tobytes()
    assert [film.complete for film in films] == [False, False, False, True]
    # Leaving the loop ends the render.
    for film in em.progressive(box, spp=1 << 20, size=(24, 16)):
        if film.samples.max() >= 4:
            break
    assert len(list(em.progressive(box, spp=64, size=(24, 16), every=1e6))) == 1


def test_progress_is_told(box: Path) -> None:
    told: List[Any] = []
    em.render(box, spp=16, size=(200, 200), progress=lambda done, total: told.append((done, total)))
    assert told[-1] == (16 * 200 * 200, 16 * 200 * 200)
    assert told == sorted(told)


def test_a_time_limit_ends_a_render(box: Path) -> None:
    film = em.render(box, spp=1 << 20, size=(64, 64), time_limit=0.3)
    assert not film.complete and film.seconds < 5 and film.samples.max() >= 1


def test_films_are_read_from_files(box: Path, tmp_path: Path) -> None:
    film = em.render(box, spp=2, size=(20, 12), crop=(2, 3, 18, 11))
    film.save(tmp_path / "a.exr")
    read = em.read(tmp_path / "a.exr")
    assert sorted(read.channels) == sorted(film.channels) and read.crop == film.crop and read.size == film.size
    for name in film.layers:
        assert (read[name] == film[name]).all(), name


def test_films_without_colours_have_their_channels(tmp_path: Path) -> None:
    depth = np.arange(6, dtype=np.float32).reshape(2, 3)
    header: Any = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with OpenEXR.File(header, {"Z": depth}) as file:
        file.write(str(tmp_path / "depth.exr"))
    film = em.read(tmp_path / "depth.exr")
    assert film.layers == ["Z"] and (film["Z"] == depth).all() and "rgb" not in film
    assert repr(film) == "<Film 3×2, Z>"
    with pytest.raises(KeyError, match="no channel rgb: there are Z'"):
        film["rgb"]


def test_keys_are_set_over_the_file(box: Path) -> None:
    scene = em.load(box, {"render.samples": 2, "image": {"width": 10, "height": 8}})
    film = em.render(scene)
    assert film["rgb"].shape == (8, 10, 3) and film.samples.max() == 2
    scene.keys["render.samples"] = 3
    assert em.render(scene).samples.max() == 3
    # Settings of the call override settings of the scene, and these override the file.
    scene.settings["spp"] = 4
    assert em.render(scene).samples.max() == 4
    assert em.render(scene, spp=5).samples.max() == 5
