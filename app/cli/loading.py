"""Objects that a process loads at its start live until its end: exclude them from garbage collection."""

from __future__ import annotations

import gc
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
