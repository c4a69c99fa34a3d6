"""`waydrop sim` becomes the simulator's own process; the cli imports nothing of it."""

from __future__ import annotations

import os
import sys

import pytest

from app.cli.main import main


@pytest.mark.parametrize(
    ("arguments", "module", "passed_on"),
    [
        (["--fleet", "quad", "--speed", "4"], "app.simulator", ["--fleet", "quad", "--speed", "4"]),
        (["--help"], "app.simulator", ["--help"]),
    ],
)
def test_the_rest_of_the_command_line_goes_to_it(
    arguments: list[str], module: str, passed_on: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    started: list[list[str]] = []

    def become(_path: str, command: list[str]) -> None:
        started.append(command)

    monkeypatch.setattr(os, "execv", become)
    monkeypatch.setattr(sys, "argv", ["waydrop", "sim", *arguments])
    with pytest.raises(SystemExit):
        main()
    assert started == [[sys.executable, "-P", "-m", module, *passed_on]]
