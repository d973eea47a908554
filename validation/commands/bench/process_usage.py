"""Run a process; print its exit code, processor time [s] and peak memory [kB or bytes].

    python process_usage.py program argument ...

A small process of its own, because the peak memory of a process begins with the memory
of the one that starts it.
"""

from __future__ import annotations

import os
import sys

if __name__ == "__main__":
    silent = (os.POSIX_SPAWN_OPEN, 1, os.devnull, os.O_WRONLY, 0)
    number = os.posix_spawn(
        sys.argv[1], sys.argv[1:], os.environ, file_actions=[silent]
    )
    _, status, usage = os.wait4(number, 0)
    code = os.waitstatus_to_exitcode(status)
    print(code, usage.ru_utime + usage.ru_stime, usage.ru_maxrss)  # noqa: T201
