"""What a process loads at its start stays until its end: the garbage collector need not look at it."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def loaded_for_good() -> Iterator[None]:
    """Import in this block what is large.

    Else the collector looks through all of it again and again while it grows, now and then while the process runs,
    and once more at its end: together as long as a third of the start.
    """
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        gc.enable()
