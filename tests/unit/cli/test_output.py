"""Standard output that cannot be written ends a command with a status of its own, in words."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest

from app.cli.main import main
from tests.support.paths import ROOT

GOOD = str(ROOT / "plans" / "clinic-run.json")


def waydrop(*arguments: str, stdout: int, **environment: str) -> subprocess.CompletedProcess[str]:
    return run("-m", "app", *arguments, stdout=stdout, **environment)


def run(*arguments: str, stdout: int, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *arguments],
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


@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_a_full_disk_is_told_of_what_is_not_written_by_our_consoles(unbuffered: str) -> None:
    """As a table for spreadsheets."""
    work = 'import app.cli.main as main; main.app = lambda **_: main.typer.echo("run,state"); main.main()'
    with open("/dev/full", "wb") as full:
        ended = run("-c", work, stdout=full.fileno(), PYTHONUNBUFFERED=unbuffered)
    assert (ended.returncode, "output.failed" in ended.stderr) == (5, True), ended.stderr


def test_a_closed_standard_input_is_told() -> None:
    work = 'import sys; sys.stdin = None; sys.argv[1:] = ["validate", "-"]; import app.cli.main as main; main.main()'
    ended = run("-c", work, stdout=subprocess.DEVNULL)
    assert (ended.returncode, "standard input is closed" in ended.stderr) == (2, True), ended.stderr


@pytest.mark.parametrize("arguments", [("validate", GOOD), ("--help",)])
def test_a_closed_pipe_is_no_failure_of_a_plan(arguments: tuple[str, ...]) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    try:
        ended = waydrop(*arguments, stdout=writing)
    finally:
        os.close(writing)
    assert ended.returncode == 5, ended.stderr
    assert "Broken pipe" in ended.stderr


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EIO, errno.EBADF])
def test_an_error_of_another_file_is_not_told_as_one_of_standard_output(
    number: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(**_: object) -> None:
        raise OSError(number, os.strerror(number), "a file of a defective disk")

    monkeypatch.setattr(sys, "stdout", sys.stdout)  # main changes it
    monkeypatch.setattr("app.cli.main.app", fails)
    with pytest.raises(OSError, match="a file of a defective disk"):
        main()


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
