"""Standard output that cannot be written ends a command with a status of its own, in words."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.paths import ROOT

GOOD = str(ROOT / "plans" / "clinic-run.json")


def waydrop(*arguments: str, stdout: int, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "app", *arguments],
        cwd=ROOT,
        env={**os.environ, "NO_COLOR": "1", **environment},
        stdout=stdout,
        stderr=subprocess.PIPE,
        text=True,
        check=False,
        timeout=120,
    )


@pytest.mark.parametrize("arguments", [("validate", GOOD), ("schema",), ("--version",), ("--help",)])
def test_a_full_disk_is_told_without_a_traceback(arguments: tuple[str, ...]) -> None:
    with open("/dev/full", "wb") as full:
        ended = waydrop(*arguments, stdout=full.fileno())
    assert ended.returncode == 5, ended.stderr
    assert "output.failed" in ended.stderr
    assert "No space left" in ended.stderr
    assert "Traceback" not in ended.stderr


def test_a_closed_pipe_is_no_failure_of_a_plan() -> None:
    reading, writing = os.pipe()
    os.close(reading)
    try:
        ended = waydrop("validate", GOOD, stdout=writing)
    finally:
        os.close(writing)
    assert ended.returncode == 5, ended.stderr
    assert "Broken pipe" in ended.stderr


def test_a_secret_that_cannot_be_written_is_told_as_lost(tmp_path: Path) -> None:
    with open("/dev/full", "wb") as full:
        ended = waydrop(
            "token", "create", "desk", "--role", "pilot", "--data-dir", str(tmp_path / "data"), stdout=full.fileno()
        )
    assert ended.returncode == 5, ended.stderr
    assert "waydrop token revoke token-" in ended.stderr


def test_a_folder_without_a_journal_gets_none_by_a_look_at_its_tokens(tmp_path: Path) -> None:
    folder = tmp_path / "wrong"
    ended = waydrop("token", "list", "--data-dir", str(folder), stdout=subprocess.DEVNULL)
    assert ended.returncode == 1
    assert "no journal" in ended.stderr
    assert not folder.exists()


def test_a_terminal_of_few_characters_shows_the_rest_escaped(tmp_path: Path) -> None:
    ended = waydrop("validate", str(tmp_path / "none.json"), stdout=subprocess.DEVNULL, PYTHONIOENCODING="ascii")
    assert ended.returncode == 2
    assert "Traceback" not in ended.stderr
