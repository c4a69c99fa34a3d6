"""`waydrop link-key`: keys are made, named by their fingerprints, and never shown."""

from __future__ import annotations

import json
import stat
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from app.cli.link_key import link_key_app
from app.domain.errors import InvalidInputError, WaydropError
from app.domain.ports.link_keys import LinkKeyError

SECRET = bytes(range(1, 33))


def run(folder: Path, *arguments: str, stdin: bytes | None = None) -> Result:
    return CliRunner().invoke(link_key_app, [*arguments, "--data-dir", str(folder)], input=stdin)


def refused(folder: Path, *arguments: str) -> WaydropError:
    error = run(folder, *arguments).exception
    assert isinstance(error, WaydropError)
    return error


def secrets_of(folder: Path) -> list[str]:
    found = json.loads((folder / "link-keys.json").read_text())
    return [entry["secret"] for entries in found["vehicles"].values() for entry in entries]


def test_keys_are_made_for_vehicles_by_either_name(tmp_path: Path) -> None:
    ran = run(tmp_path, "create", "v1", "7")
    assert ran.exit_code == 0, ran.output
    assert [line.split()[0] for line in ran.stdout.splitlines()] == ["1", "7"]
    assert stat.S_IMODE((tmp_path / "link-keys.json").stat().st_mode) == 0o600


def test_no_command_shows_a_secret(tmp_path: Path) -> None:
    said = run(tmp_path, "create", "v1").output + run(tmp_path, "list").output
    assert all(secret not in said for secret in secrets_of(tmp_path))


def test_the_list_tells_new_keys_from_those_in_use(tmp_path: Path) -> None:
    new = run(tmp_path, "create", "v1").stdout.split()[1]
    (tmp_path / "key").write_bytes(SECRET)
    used = run(tmp_path, "create", "v2", "--from", str(tmp_path / "key")).stdout.split()[1]
    rows = {fingerprint: line for line in run(tmp_path, "list").stdout.splitlines() for fingerprint in line.split()}
    assert "new" in rows[new]
    assert "in use" in rows[used]


@pytest.mark.parametrize("given", [SECRET, SECRET.hex().encode(), SECRET.hex().upper().encode() + b"\n"])
def test_a_key_from_elsewhere_is_taken_from_a_file_or_standard_input(tmp_path: Path, given: bytes) -> None:
    (tmp_path / "key").write_bytes(given)
    assert run(tmp_path, "create", "v1", "--from", str(tmp_path / "key")).exit_code == 0
    assert run(tmp_path, "create", "v2", "--from", "-", stdin=given).exit_code == 0
    assert secrets_of(tmp_path) == [SECRET.hex()] * 2


@pytest.mark.parametrize("given", [b"", b"short", bytes(32), b"0" * 64, b"z" * 64], ids=str)
def test_what_is_no_key_is_refused(tmp_path: Path, given: bytes) -> None:
    (tmp_path / "key").write_bytes(given)
    assert "is not a key" in refused(tmp_path, "create", "v1", "--from", str(tmp_path / "key")).detail
    assert not (tmp_path / "link-keys.json").exists()


def test_one_key_is_for_one_vehicle(tmp_path: Path) -> None:
    (tmp_path / "key").write_bytes(SECRET)
    assert "one vehicle" in refused(tmp_path, "create", "v1", "v2", "--from", str(tmp_path / "key")).detail


@pytest.mark.parametrize("vehicle", ["0", "256", "v", "vx", "-1", "1.5", "v1-"])
def test_what_is_no_vehicle_is_refused(tmp_path: Path, vehicle: str) -> None:
    assert isinstance(run(tmp_path, "create", "--", vehicle).exception, InvalidInputError | SystemExit)
    assert not (tmp_path / "link-keys.json").exists()


def test_a_key_is_forgotten_by_its_fingerprint(tmp_path: Path) -> None:
    made = run(tmp_path, "create", "v1").stdout.split()[1]
    assert isinstance(refused(tmp_path, "remove", "v1", "0" * 16), LinkKeyError)
    assert run(tmp_path, "remove", "v1", made).exit_code == 0
    assert secrets_of(tmp_path) == []


def test_a_key_is_sent_only_over_a_link_that_somebody_trusts() -> None:
    ran = CliRunner().invoke(link_key_app, ["setup", "v1", "--server", "http://127.0.0.1:9"])
    assert isinstance(ran.exception, InvalidInputError)
    assert "--trust-link" in ran.exception.hint
