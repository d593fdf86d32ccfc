"""Runs a command, and prints its exit status, the seconds it took, its processor seconds, and its peak memory in kilobytes.

A process of its own, and a small one: what a parent takes before it starts a child counts as the child's (Linux, ru_maxrss).
"""

import os
import sys
import time

start = time.perf_counter()
pid = os.posix_spawn(sys.argv[2], sys.argv[2:], os.environ, file_actions=[
    (os.POSIX_SPAWN_OPEN, 1, sys.argv[1], os.O_WRONLY | os.O_CREAT, 0o600),
    (os.POSIX_SPAWN_DUP2, 1, 2),
])
_, status, usage = os.wait4(pid, 0)
print(os.waitstatus_to_exitcode(status), time.perf_counter() - start, usage.ru_utime + usage.ru_stime, usage.ru_maxrss)
