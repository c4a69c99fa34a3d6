"""Nobody but its owner has access to the data folder, and no other folder is touched."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from pathlib import Path

import pytest

from app.config import SettingsError
from app.data_folder import claim_data_folder, folder_address


def mode(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


@pytest.fixture(autouse=True)
def careless_umask() -> Iterator[None]:
    before = os.umask(0)
    yield
    os.umask(before)


def test_a_new_folder_is_its_owners_alone(tmp_path: Path) -> None:
    claim_data_folder(tmp_path / "new" / "data")
    assert mode(tmp_path / "new" / "data") == 0o700


def test_a_folder_of_an_older_version_is_restricted_with_all_that_is_in_it(tmp_path: Path) -> None:
    data = tmp_path / "data"
    files = [data / "waydrop.db", data / "attachments" / "ab" / "abcd"]
    for file in files:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(b"x")
    outside = tmp_path / "outside"
    outside.write_bytes(b"x")
    (data / "link").symlink_to(outside)
    claim_data_folder(data)
    assert [mode(path) for path in (data, data / "attachments", data / "attachments" / "ab")] == [0o700] * 3
    assert [mode(file) for file in files] == [0o600] * 2
    assert mode(outside) == 0o666, "what a link points to is not ours"


def test_an_empty_folder_is_restricted(tmp_path: Path) -> None:
    (tmp_path / "data").mkdir()
    claim_data_folder(tmp_path / "data")
    assert mode(tmp_path / "data") == 0o700


@pytest.mark.parametrize("folder_mode", [0o755, 0o770])
def test_a_folder_with_files_of_others_is_refused_and_not_touched(tmp_path: Path, folder_mode: int) -> None:
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "thesis.tex").write_text("x")
    (tmp_path / "data").chmod(folder_mode)
    with pytest.raises(SettingsError, match="other users"):
        claim_data_folder(tmp_path / "data")
    assert mode(tmp_path / "data") == folder_mode


def test_a_folder_that_all_users_share_is_refused_though_a_journal_is_in_it(tmp_path: Path) -> None:
    (tmp_path / "shared").mkdir()
    (tmp_path / "shared" / "waydrop.db").write_bytes(b"x")
    (tmp_path / "shared").chmod(0o1777)
    with pytest.raises(SettingsError, match="other users"):
        claim_data_folder(tmp_path / "shared")
    assert mode(tmp_path / "shared") == 0o1777


def test_a_private_folder_may_contain_anything(tmp_path: Path) -> None:
    (tmp_path / "data").mkdir(mode=0o700)
    (tmp_path / "data" / "thesis.tex").write_text("x")
    claim_data_folder(tmp_path / "data")
    assert mode(tmp_path / "data" / "thesis.tex") == 0o666


def test_a_file_in_its_place_is_told(tmp_path: Path) -> None:
    (tmp_path / "data").write_text("x")
    with pytest.raises(SettingsError, match="WAYDROP_DATA_DIR"):
        claim_data_folder(tmp_path / "data")


def test_a_folder_keeps_its_address_and_a_copy_has_another(tmp_path: Path) -> None:
    for name in ("data", "copy"):
        (tmp_path / name).mkdir()
    address = folder_address(tmp_path / "data")
    assert folder_address(tmp_path / "data" / ".." / "data") == address
    assert folder_address(tmp_path / "copy") != address
