"""BSDFs on arrays, samplers and comparisons."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any, Callable

import numpy as np
import pytest

import embrasure as em


def directions(n: int, seed: int) -> Any:
    """Uniform directions of the upper hemisphere."""
    z, phi = np.random.default_rng(seed).uniform(size=(2, n))
    phi *= 2 * np.pi
    r = np.sqrt(1 - z * z)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=1)


def test_a_matte_surface_is_lamberts() -> None:
    matte = em.bsdf(em.Material(diffuse=[0.8, 0.4, 0.2]))
    wo, wi = directions(100, 1), directions(100, 2)
    assert np.allclose(matte.eval(wo, wi), np.array([0.8, 0.4, 0.2]) / np.pi, rtol=1e-5)
    assert np.allclose(matte.pdf(wo, wi), wi[:, 2] / np.pi, rtol=1e-4)
    assert np.allclose(matte.albedo, [0.8, 0.4, 0.2]) and not matte.is_delta
    assert [name for name, _ in matte.lobes] == ["Lambert"]
    assert matte.eval([0, 0, 1], [0, 0, 1]).shape == (3,) and matte.pdf([0, 0, 1], wi).shape == (100,)


@pytest.mark.parametrize("roughness", [0.3, 0.7])
def test_samples_have_their_values_and_densities(roughness: float) -> None:
    glossy = em.bsdf(em.Material(diffuse=[0.3, 0.3, 0.3], model="ggx", specular=[0.5, 0.5, 0.5], roughness=roughness))
    wo = np.array([0.5, 0.0, np.sqrt(0.75)])
    u = np.random.default_rng(3).uniform(size=(20000, 3))
    drawn = glossy.sample(wo, u)
    there = drawn.pdf > 0
    assert there.mean() > 0.9 and not drawn.is_delta.any()
    assert np.allclose(glossy.eval(wo, drawn.wi[there]), drawn.f[there], rtol=2e-3, atol=1e-5)
    assert np.allclose(glossy.pdf(wo, drawn.wi[there]), drawn.pdf[there], rtol=2e-3, atol=1e-5)
    weights = drawn.f * (np.abs(drawn.wi[:, 2]) / np.where(there, drawn.pdf, 1))[:, None]
    assert np.allclose(weights[there], drawn.weight[there], rtol=2e-3, atol=1e-5)
    # Albedo for this direction, from samples and from uniform directions
    wi = directions(400_000, 4)
    uniform = (glossy.eval(wo, wi)[:, 0] * wi[:, 2]).mean() * 2 * np.pi
    assert abs(drawn.weight[:, 0].mean() - uniform) < 0.02
    # The density integrates to 1, except for samples below the surface.
    assert abs(glossy.pdf(wo, wi).mean() * 2 * np.pi - there.mean()) < 0.02


def test_a_mirror_is_a_delta_lobe() -> None:
    mirror = em.bsdf(em.Material(model="mirror", specular=[1, 1, 1]))
    drawn = mirror.sample([0.6, 0, 0.8], [0.5, 0.5, 0.5])
    assert mirror.is_delta and bool(drawn.is_delta)
    assert np.allclose(drawn.wi, [-0.6, 0, 0.8])
    assert (mirror.eval([0.6, 0, 0.8], [-0.6, 0, 0.8]) == 0).all()


def test_materials_of_scenes_have_their_names(box: Path) -> None:
    scene = em.load(box)
    assert em.bsdf("white", scene).albedo[0] > 0.6
    dark = em.load(box, material={"white": {"diffuse": [0.1, 0.1, 0.1]}})
    assert np.allclose(em.bsdf("white", dark).albedo, 0.1)
    with pytest.raises(em.SettingError, match="no face uses the material blue\n  help: use one of "):
        em.bsdf("blue", scene)
    assert em.bsdf("white", box).albedo == em.bsdf("white", scene).albedo
    with pytest.raises(ValueError, match="give the scene"):
        em.bsdf("white")
    with pytest.raises(em.SettingError, match="roughness"):
        em.bsdf(em.Material(roughness="rough"))


def test_directions_and_numbers_are_checked() -> None:
    matte = em.bsdf(em.Material(diffuse=0.5))
    up = [0.0, 0.0, 1.0]
    wrong: Any
    for wrong in ([1, 0, 1], [np.nan, 0, 1], [1e-30, 0, 0], [[0, 0, 1], [0, 0, 2]]):
        with pytest.raises(ValueError, match="wo: unit vectors are expected"):
            matte.eval(wrong, up)
        with pytest.raises(ValueError, match="wi: unit vectors are expected"):
            matte.pdf(up, wrong)
    with pytest.raises(ValueError, match=r"wo and wi: arrays of the same shape are expected, not of \(2, 3\) and \(4, 3\)"):
        matte.eval(np.zeros((2, 3)), np.zeros((4, 3)))
    for wrong in ([1, 0, 0], [-0.1, 0, 0], [0, np.nan, 0]):
        with pytest.raises(ValueError, match=r"u: numbers from \[0, 1\)"):
            matte.sample(up, wrong)
    # float32 rounds this number to 1.
    drawn = matte.sample(up, [1 - 1e-12] * 3)
    assert np.isfinite(drawn.wi).all() and abs(np.linalg.norm(drawn.wi) - 1) < 1e-4
    # A direction of length 0 gives 0, also for glass.
    for surface in (matte, em.bsdf(em.Material(transmission=[1, 1, 1], ior=1.5, roughness=0.4))):
        assert surface.pdf(up, [up, [0, 0, 0]])[1] == 0 and (surface.eval(up, [up, [0, 0, 0]])[1] == 0).all()
        assert (surface.sample([0, 0, 0], [0.5] * 3).wi == 0).all() and surface.sample([0, 0, 0], [0.5] * 3).pdf == 0
    assert matte.eval(np.zeros((0, 3)), up).shape == (0, 3)
    with pytest.raises(TypeError, match="Material"):
        em.bsdf({"diffuse": 0.5})  # type: ignore[arg-type]


def test_numbers_of_points_are_checked() -> None:
    sobol = em.sampler("sobol", seed=int(np.uint64(2**64 - 1)))
    assert sobol.points(0, 2).shape == (0, 2) and sobol.points(3, 0).shape == (3, 0)
    with pytest.raises(ValueError, match="n: a whole number from 0 to"):
        sobol.points(-1, 2)
    with pytest.raises(ValueError, match="pixel: a whole number"):
        sobol.points(1, 2, pixel=(0, -1))
    with pytest.raises(ValueError, match="seed: a whole number"):
        em.sampler("sobol", seed=-1)
    with pytest.raises(TypeError):
        sobol.points(1.5, 2)  # type: ignore[arg-type]
    with pytest.raises(MemoryError, match="do not fit into memory"):
        sobol.points(2**32 - 1, 2**32 - 1)


@pytest.mark.skipif(not Path("/proc/meminfo").exists(), reason="free memory is known on Linux only")
def test_points_beyond_free_memory_are_an_error() -> None:
    lines = Path("/proc/meminfo").read_text().splitlines()
    total = next(1024 * int(line.split()[1]) for line in lines if line.startswith("MemTotal:"))
    with pytest.raises(MemoryError, match=r"numbers do not fit into memory: they take .* GB, .* are free"):
        em.sampler("sobol").points(2 * total // 4 // 2**16, 2**16)


def test_points_are_those_of_the_command_line(tmp_path: Path, command: Callable[..., Any]) -> None:
    done: subprocess.CompletedProcess[str] = command("points", "sobol", "-n", 64, "--json")
    assert done.returncode == 0, done.stderr
    projections = {p["name"]: np.array(p["points"]) for p in json.loads(done.stdout)["projections"]}
    points = em.sampler("sobol").points(64, 7)
    assert points.shape == (64, 7) and points.dtype == np.float32
    assert np.allclose(points[:, :2], projections["pixel"], atol=1e-7)
    assert np.allclose(points[:, 2:4], projections["lens"], atol=1e-7)
    assert points.min() >= 0 and points.max() < 1
    assert (em.sampler("sobol", seed=1).points(64, 7) != points).any()
    assert (em.sampler("sobol").points(64, 7, pixel=(1, 0)) != points).any()
    # Each of 64 rows of the square has one Sobol point. Independent points leave rows empty.
    assert len(np.unique(np.floor(points[:, 0] * 64))) == 64
    assert len(np.unique(np.floor(em.sampler("independent").points(64, 1)[:, 0] * 64))) < 60


def test_comparisons_are_those_of_the_command_line(box: Path, tmp_path: Path, command: Callable[..., Any]) -> None:
    settings: Any = {"size": (64, 64)}
    reference = em.render(box, spp=256, seed=1, **settings)
    image = em.render(box, spp=128, seed=2, **settings)
    other = em.render(box, spp=128, seed=2, max_depth=1, **settings)
    paths = [tmp_path / f"{name}.exr" for name in "abc"]
    for film, path in zip((reference, image, other), paths):
        film.save(path)
    for film, path in ((image, paths[1]), (other, paths[2]), (reference, paths[0])):
        done = command("compare", paths[0], path, "--json")
        expected = json.loads(done.stdout)
        found = em.compare(reference, film)
        for facts in (expected, found.facts):
            del facts["reference"], facts["image"]
        assert found.facts == expected
        by_files = em.compare(paths[0], path)
        assert (by_files.mse, by_files.p) == (found.mse, found.p)
    assert em.compare(reference, image).outcome == "equal within noise"
    assert em.compare(reference, other).outcome == "differs"
    assert em.compare(reference, reference).outcome == "identical"
    arrays = em.compare(reference["rgb"], image["rgb"])
    difference = image["rgb"].astype(np.float64) - reference["rgb"]
    assert abs(arrays.mse - (difference**2).mean()) < 1e-9 and arrays.p is None
    with pytest.raises(em.Error, match="64x64"):
        em.compare(reference, reference["rgb"][:32])
    with pytest.raises(ValueError, match="8-bit"):
        em.compare(reference.develop(), image.develop())
    for wrong in (0, 1, float("nan")):
        with pytest.raises(ValueError, match="significance"):
            em.compare(reference, image, significance=wrong)
    # Arrays that are not contiguous
    assert em.compare(reference["rgb"][:, ::-1], reference["rgb"][:, ::-1]).outcome == "identical"
