"""Objects that a process loads at its start live until its end: exclude them from garbage collection."""

from __future__ import annotations

import gc
import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def loaded_for_good() -> Iterator[None]:
    """Import large modules in this block.

    Otherwise the collector scans them repeatedly while they load, now and then later, and once more at the end:
    together a third of the startup time.
    """
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        gc.enable()


def end_at_sigterm() -> None:
    """Until the service takes signals itself: the kernel ignores SIGTERM for a container's first process otherwise.

    At once, since nothing has begun: an exception could be lost in a callback of the import system.
    """
    signal.signal(signal.SIGTERM, lambda number, _: os._exit(128 + number))
