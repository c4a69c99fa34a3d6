"""SIGTERM ends a container's first process also while modules are imported, and is never lost."""

from __future__ import annotations

import signal
import subprocess
import sys


def test_sigterm_ends_the_process_even_where_an_exception_would_be_lost() -> None:
    in_a_finalizer = (
        "import os, signal\n"
        "from app.cli.loading import end_at_sigterm\n"
        "end_at_sigterm()\n"
        "class Held:\n"
        "    def __del__(self): os.kill(os.getpid(), signal.SIGTERM)\n"
        "held = Held()\n"
        "del held\n"
        "print('went on')\n"
    )
    ended = subprocess.run([sys.executable, "-c", in_a_finalizer], capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stdout) == (128 + signal.SIGTERM, "")
