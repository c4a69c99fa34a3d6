"""The worker process: takes calls of pure functions from its parent's pipe, and answers each. See worker_process.

It imports nothing but what the calls name. It ends with its parent: the pipe ends then, however the parent ended.
"""

from __future__ import annotations

import os
import pickle
import signal
import struct
from contextlib import suppress
from queue import Queue
from threading import Thread
from typing import BinaryIO, Final

HEAD: Final = struct.Struct("!Q")
"""The length of the pickle that follows."""
NICE: Final = 10
"""The service and its setpoints come first."""


def framed(pickled: bytes) -> bytes:
    return HEAD.pack(len(pickled)) + pickled


def _take_calls(pipe: BinaryIO, calls: Queue[bytes]) -> None:
    """Runs in a thread, so that the process ends with its parent in the middle of its work, too."""
    while len(head := pipe.read(HEAD.size)) == HEAD.size:
        calls.put(pipe.read(*HEAD.unpack(head)))
    os._exit(0)


def main() -> None:
    """Answer calls. A defect in a function ends the process: the parent then runs it itself."""
    for number in (signal.SIGINT, signal.SIGTERM):  # those are for the parent, which ends the pipe when it is ready
        signal.signal(number, signal.SIG_IGN)
    with suppress(OSError):  # forbidden: then it works like others
        os.nice(NICE)
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a function prints is no answer
    calls: Queue[bytes] = Queue(maxsize=1)
    Thread(target=_take_calls, args=(os.fdopen(0, "rb"), calls), name="calls", daemon=True).start()
    while True:
        work, given = pickle.loads(calls.get())
        answers.write(framed(pickle.dumps(work(*given), pickle.HIGHEST_PROTOCOL)))
        answers.flush()


if __name__ == "__main__":
    with suppress(BrokenPipeError):  # the parent has just ended
        main()
