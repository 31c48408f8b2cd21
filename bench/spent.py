"""What a process takes, for the benchmarks of whole programs."""
import os
import subprocess
import time


def spent(words, folder):
    """Seconds of the clock, of CPU, peak MB; None where the program cannot."""
    start = time.monotonic()
    process = subprocess.Popen(words, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    wall = time.monotonic() - start
    return (wall, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024) if process.returncode == 0 else None
