"""mavsdk's cache directory is there before mavsdk looks for it, wherever a user's home is."""

from __future__ import annotations

from pathlib import Path

import pytest

from app.vehicles.native import provide_cache_directory

CACHE = Path(".cache/mavsdk/component_metadata")


def test_it_is_made_in_the_users_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    provide_cache_directory(tmp_path / "data")
    assert (tmp_path / "home" / CACHE).is_dir()
    assert not (tmp_path / "data").exists()


@pytest.mark.parametrize("home", ["a_file", None])
def test_a_home_that_takes_none_is_replaced_by_the_data_directory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, home: str | None
) -> None:
    (tmp_path / "a_file").write_text("not a folder")
    if home is None:
        monkeypatch.delenv("HOME", raising=False)
        monkeypatch.setattr(Path, "home", lambda: tmp_path / "a_file")
    else:
        monkeypatch.setenv("HOME", str(tmp_path / home))
    provide_cache_directory(tmp_path / "data")
    assert (tmp_path / "data" / CACHE).is_dir()
