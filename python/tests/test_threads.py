"""Interrupts, exceptions of callbacks, several renders at once, and memory."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any, Dict, List

import pytest

import embrasure as em

FOREVER: Dict[str, Any] = {"spp": 1 << 20, "size": (256, 256)}


@pytest.mark.parametrize("integrator", ["path", "bdpt", "sppm"])
def test_an_interrupt_ends_a_render_within_a_second(box: Path, integrator: str) -> None:
    sent: List[float] = []

    def interrupt() -> None:
        sent.append(time.monotonic())
        os.kill(os.getpid(), signal.SIGINT)

    timer = threading.Timer(0.7, interrupt)
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        em.render(box, integrator=integrator, **FOREVER)
    assert time.monotonic() - sent[0] < 1.0
    # The next render works normally.
    assert em.render(box, spp=1, size=(8, 8)).complete


def test_an_interrupt_ends_a_script(box: Path) -> None:
    script = f"import embrasure as em\nprint('now', flush=True)\nfor film in em.progressive({str(box)!r}, spp=1 << 20): pass"
    running = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert running.stdout is not None
    running.stdout.readline()
    time.sleep(0.7)
    start = time.monotonic()
    running.send_signal(signal.SIGINT)
    _, said = running.communicate(timeout=30)
    assert time.monotonic() - start < 2.0 and "KeyboardInterrupt" in said and running.returncode != 0


def test_an_exception_of_the_callback_ends_the_render(box: Path) -> None:
    def refuse(done: int, total: int) -> None:
        raise RuntimeError(f"{total} are too many")

    with pytest.raises(RuntimeError, match="too many"):
        em.render(box, progress=refuse, **FOREVER)


def test_forked_processes_trace_rays_and_render(box: Path) -> None:
    # The acceleration structure of the parent needs threads that the child does not have.
    script = f"""
import os, sys
import embrasure as em
scene = em.load({str(box)!r})
def look(): return em.intersect(scene, [0, 1, 3], [0, 0, -1]).t.tobytes() + em.render(scene, spp=1, size=(8, 8))["rgb"].tobytes()
seen = look()
if child := os.fork():
    sys.exit(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
os._exit(0 if look() == seen else 3)
"""
    done = subprocess.run([sys.executable, "-W", "ignore", "-c", script], timeout=60)
    assert done.returncode == 0


def test_forked_processes_denoise_compare_and_save(box: Path, tmp_path: Path) -> None:
    script = f"""
import multiprocessing, sys
import embrasure as em
film, other = (em.render({str(box)!r}, spp=4, size=(32, 32), seed=seed) for seed in range(2))
part = em.render({str(box)!r}, spp=128, size=(8, 8), samples="0..64")
def work(name):
    shown = [film.develop(denoise=denoise).tobytes() for denoise in ("atrous", "gaussian", True)]
    part.save({str(tmp_path)!r} + "/" + name + ".exr")
    return shown, str(em.compare(film, other)), em.bsdf("white", {str(box)!r}).albedo
if __name__ == "__main__":
    here = work("parent")
    with multiprocessing.get_context(sys.argv[1]).Pool(2) as pool:
        sys.exit(0 if pool.map(work, ["a", "b"]) == [here] * 2 else 3)
"""
    path = tmp_path / "script.py"
    path.write_text(script)
    for method in ("fork", "spawn", "forkserver"):
        done = subprocess.run([sys.executable, "-W", "ignore", path, method], timeout=120)
        assert done.returncode == 0, method


@pytest.mark.parametrize(("what", "help"), [("scene", "load()"), ("film", "save()"), ("bsdf", "make it"), ("mesh", "load()")])
def test_pickling_says_what_cannot_be_pickled(box: Path, what: str, help: str) -> None:
    mesh = em.Scene()
    mesh.add_mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    made: Any = {
        "scene": lambda: em.load(box),
        "film": lambda: em.render(box, spp=1, size=(4, 4)),
        "bsdf": lambda: em.bsdf(em.Material(diffuse=0.5)),
        "mesh": lambda: mesh,
    }[what]()
    with pytest.raises(TypeError, match="cannot pickle a .*: ") as raised:
        pickle.dumps(made)
    assert help in str(raised.value)


def test_two_renders_at_once_work_and_leave_the_lock(box: Path) -> None:
    settings: Dict[str, Any] = {"spp": 16, "size": (96, 96), "threads": 1}
    alone = [em.render(box, seed=seed, **settings)["rgb"].tobytes() for seed in range(2)]
    found: Dict[int, bytes] = {}

    def work(seed: int) -> None:
        found[seed] = em.render(box, seed=seed, **settings)["rgb"].tobytes()

    threads = [threading.Thread(target=work, args=(seed,)) for seed in range(2)]
    for thread in threads:
        thread.start()
    # This thread must get turns while the other threads render.
    turns = 0
    while any(thread.is_alive() for thread in threads):
        turns += 1
        time.sleep(0.001)
    assert [found[0], found[1]] == alone and turns > 5
    assert alone[0] != alone[1]


def test_memory_stays_flat_over_a_thousand_scenes(box: Path) -> None:
    corners = [[-1, -1, 0], [1, -1, 0], [0, 1, 0]]

    def use() -> None:
        scene = em.Scene()
        scene.add_mesh(corners, [[0, 1, 2]], material=em.Material(diffuse=[0.5, 0.5, 0.5]))
        scene.camera = {"position": [0, 0, 3], "look_at": [0, 0, 0]}
        scene.add_light("point", position=[0, 0, 2], intensity=[1, 1, 1])
        film = em.render(scene, spp=1, size=(16, 16), threads=1)
        assert film["rgb"].max() > 0
        em.intersect(scene, [[0, 0, 1]], [[0, 0, -1]], threads=1)

    def resident() -> int:
        fields = Path("/proc/self/statm").read_text().split()
        return int(fields[1]) * os.sysconf("SC_PAGE_SIZE")

    for _ in range(100):
        use()
    before = resident()
    for _ in range(1000):
        use()
    # A film of 16 × 16 pixels and 14 channels has 14 KB, so a thousand of them would be visible.
    assert resident() - before < 8 << 20
