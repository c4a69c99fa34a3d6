"""A command that needs one setting finds what the service has."""

from __future__ import annotations

from pathlib import Path

import pytest

from app.cli.variables import variable
from app.config import load_settings


@pytest.mark.parametrize(
    ("variables", "files", "host"),
    [
        ({}, {}, None),
        ({"WAYDROP_HOST": "10.0.0.1"}, {"waydrop_host": "10.0.0.2"}, "10.0.0.1"),
        ({"waydrop_host": "10.0.0.1"}, {}, "10.0.0.1"),
        ({"WAYDROP_HOST": ""}, {"waydrop_host": "10.0.0.2\n"}, "10.0.0.2"),
        ({}, {"WAYDROP_HOST": "10.0.0.2"}, "10.0.0.2"),
    ],
)
def test_a_variable_or_secret_file_is_found_as_the_settings_find_it(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    variables: dict[str, str],
    files: dict[str, str],
    host: str | None,
) -> None:
    monkeypatch.delenv("WAYDROP_HOST", raising=False)
    monkeypatch.setenv("WAYDROP_SECRETS_DIR", str(tmp_path))
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    assert variable("WAYDROP_HOST") == host
    assert load_settings().host == (host or "127.0.0.1")
