"""`waydrop replay`: 0 as it was decided, 1 with a difference, 2 when it cannot be said."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Iterable
from pathlib import Path

import pytest

from app.domain.flight.recording import Line, as_text
from app.storage import open_storage
from tests.support.commands import Capture, status_of
from tests.support.flown_flights import Flown
from tests.support.recorded_flight import recorded


def journal_with(folder: Path, lines: Iterable[Line]) -> None:
    async def once() -> None:
        async with open_storage(folder / "waydrop.db") as storage:
            await storage.flight_log.append("run-1", as_text(lines))

    asyncio.run(once())


def a_flight() -> list[Line]:
    flown = Flown()
    flown.to_the_end()
    return recorded(flown.seen)[0]


def test_a_flight_that_is_decided_as_it_was_ends_with_0(
    monkeypatch: pytest.MonkeyPatch, capsys: Capture, tmp_path: Path
) -> None:
    lines = a_flight()
    journal_with(tmp_path, lines)
    assert status_of(monkeypatch, "replay", "run-1", "--data-dir", str(tmp_path)) == 0
    assert f"{len(lines) - 1} inputs: decided as then" in capsys.readouterr().err


def test_a_difference_ends_with_1_and_is_shown_with_its_moment(
    monkeypatch: pytest.MonkeyPatch, capsys: Capture, tmp_path: Path
) -> None:
    lines = a_flight()
    ordered = next(line for line in lines if "ReleaseCommand" in json.dumps(line))
    at_s = ordered["observed"]["now_s"] - lines[0]["now_s"]
    ordered["effects"] = [effect for effect in ordered["effects"] if "command" not in effect]
    journal_with(tmp_path, lines)
    assert status_of(monkeypatch, "replay", "run-1", "--data-dir", str(tmp_path)) == 1
    shown = capsys.readouterr()
    assert f"at {at_s:.1f} s, Observed:" in shown.out
    assert '"command": "ReleaseCommand"' in shown.out.split("today:")[1]
    assert "1 difference" in shown.err
    assert status_of(monkeypatch, "replay", "run-1", "--json", "--data-dir", str(tmp_path)) == 1
    (difference,) = json.loads(capsys.readouterr().out)["differences"]
    assert difference["at_s"] == pytest.approx(at_s)


def test_a_run_without_inputs_and_a_missing_journal_end_with_2(
    monkeypatch: pytest.MonkeyPatch, capsys: Capture, tmp_path: Path
) -> None:
    assert status_of(monkeypatch, "replay", "run-1", "--data-dir", str(tmp_path)) == 2
    assert "there is no journal at" in capsys.readouterr().err
    journal_with(tmp_path, a_flight())
    assert status_of(monkeypatch, "replay", "run-2", "--data-dir", str(tmp_path)) == 2
    assert "no inputs of run 'run-2' are stored" in capsys.readouterr().err
