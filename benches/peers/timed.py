"""Runs a command, and prints its exit status, seconds, processor seconds and peak memory in kilobytes.

This is a separate small process: the memory of a parent before it starts a child counts for the
child (Linux, ru_maxrss).
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
