"""Forks of a process that has used the library.

Embree's scheduler has its own threads, and no call waits for them. If such a thread holds a lock
during a fork, the lock stays locked in the child.
"""

from __future__ import annotations

import os
import threading
import time
from pathlib import Path

_TASKS = Path("/proc/self/task")
#: Maximum wait in seconds. The wait needs a limit, because a thread of the caller may never sleep.
_PATIENCE = 0.1


def _wait_until_others_sleep() -> None:
    """Waits until all other threads of this process sleep, so that they hold no lock."""
    this = str(threading.get_native_id())
    end = time.monotonic() + _PATIENCE
    while any(_is_running(task) for task in os.listdir(_TASKS) if task != this) and time.monotonic() < end:
        time.sleep(0.001)


def _is_running(task: str) -> bool:
    try:
        # The state follows the name, which may contain brackets.
        return (_TASKS / task / "stat").read_text().rpartition(") ")[2][:1] in "RD"
    except OSError:
        return False


def register() -> None:
    """Makes forks wait for other threads, if the system shows the states of threads."""
    if _TASKS.is_dir():
        os.register_at_fork(before=_wait_until_others_sleep)
