"""What is loaded at the start is no work for the garbage collector."""

from __future__ import annotations

import gc

import pytest

from app.cli.loading import loaded_for_good


def test_the_collector_rests_meanwhile_and_then_leaves_alone_what_was_loaded() -> None:
    frozen = gc.get_freeze_count()
    with loaded_for_good():
        assert not gc.isenabled()
        loaded = [[number] for number in range(100)]
    assert gc.isenabled()
    assert gc.get_freeze_count() >= frozen + len(loaded)


def test_it_goes_on_with_its_work_also_when_something_cannot_be_loaded() -> None:
    with pytest.raises(ImportError), loaded_for_good():
        raise ImportError("mavsdk")
    assert gc.isenabled()
