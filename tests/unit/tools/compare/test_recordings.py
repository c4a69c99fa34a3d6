"""Which files are recordings."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tools.compare.trace import TraceError, read_trace, trace_files


@pytest.mark.parametrize("text", ["", "no json", json.dumps({"scenario": "x"}), json.dumps([1])])
def test_a_file_that_is_no_recording_is_refused_by_name(text: str, tmp_path: Path) -> None:
    (tmp_path / "x.jsonl").write_text(text)
    with pytest.raises(TraceError, match=r"x\.jsonl is no recording"):
        read_trace(tmp_path / "x.jsonl")


def test_recordings_are_found_zipped_or_not_and_nothing_else(tmp_path: Path) -> None:
    for name in ("b.jsonl", "a.jsonl.gz", "README.md"):
        (tmp_path / name).touch()
    assert [path.name for path in trace_files(tmp_path)] == ["a.jsonl.gz", "b.jsonl"]
