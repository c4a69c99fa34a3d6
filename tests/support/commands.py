"""Each command ends with the exit status that is documented, and says why in words."""

from __future__ import annotations

import sys

import pytest

from app.cli.main import main


def status_of(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int:
    monkeypatch.setattr(sys, "argv", ["waydrop", *arguments])
    with pytest.raises(SystemExit) as ended:
        main()
    return int(ended.value.code or 0)


Capture = pytest.CaptureFixture[str]
