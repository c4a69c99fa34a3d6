"""A command that needs one setting finds what the service has."""

from __future__ import annotations

from pathlib import Path

import pytest

from app.cli.variables import variable
from app.config import SettingsError, load_settings
from app.domain.errors import InvalidInputError


@pytest.fixture(autouse=True)
def no_variable_but_the_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("WAYDROP_HOST", raising=False)
    monkeypatch.setenv("WAYDROP_SECRETS_DIR", str(tmp_path))


@pytest.mark.parametrize(
    ("variables", "files", "host"),
    [
        ({}, {}, None),
        ({"WAYDROP_HOST": "10.0.0.1"}, {"waydrop_host": "10.0.0.2"}, "10.0.0.1"),
        ({"waydrop_host": "10.0.0.1"}, {}, "10.0.0.1"),
        ({"WAYDROP_HOST": "10.0.0.1", "waydrop_host": "10.0.0.2"}, {}, "10.0.0.2"),
        ({"waydrop_host": "10.0.0.1", "WAYDROP_HOST": "10.0.0.2"}, {}, "10.0.0.2"),
        ({"waydrop_host": "10.0.0.1", "WAYDROP_HOST": ""}, {}, "10.0.0.1"),
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
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    assert variable("WAYDROP_HOST") == host
    assert load_settings().host == (host or "127.0.0.1")


def test_a_file_that_is_no_utf_8_is_refused_as_the_settings_refuse_it(tmp_path: Path) -> None:
    (tmp_path / "waydrop_host").write_bytes(b"\xff\xfe")
    for find in (load_settings, lambda: variable("WAYDROP_HOST")):
        with pytest.raises(InvalidInputError, match="WAYDROP_HOST: "):
            find()


def test_a_folder_that_is_not_there_is_refused_as_the_settings_refuse_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("WAYDROP_SECRETS_DIR", str(tmp_path / "none"))
    with pytest.raises(SettingsError) as settings:
        load_settings()
    with pytest.raises(InvalidInputError, match="none is no folder") as single:
        variable("WAYDROP_HOST")
    assert single.value.detail == settings.value.detail


@pytest.mark.filterwarnings("ignore:attempted to load secret file")
@pytest.mark.parametrize("is_link", [True, False])
def test_what_the_settings_take_for_no_secret_file_is_none(
    tmp_path: Path, tmp_path_factory: pytest.TempPathFactory, is_link: bool
) -> None:
    elsewhere = tmp_path_factory.mktemp("elsewhere") / "host"
    elsewhere.write_text("10.0.0.1")
    if is_link:
        (tmp_path / "waydrop_host").symlink_to(elsewhere)
    else:
        (tmp_path / "waydrop_host").mkdir()
    assert variable("WAYDROP_HOST") is None
    assert load_settings().host == "127.0.0.1"
