"""Each command ends with the exit status that is documented, and says why in words."""

from __future__ import annotations

import asyncio
import inspect
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import typer

from app.cli.main import app
from app.domain.events import NewEvent
from app.domain.events.service import ServiceStarted
from app.storage import open_storage
from tests.support.commands import Capture, status_of
from tests.support.paths import ROOT

GOOD = ROOT / "plans" / "clinic-run.json"


@pytest.fixture(autouse=True)
def _wide_and_plain(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.setenv("NO_COLOR", "1")
    monkeypatch.setattr("app.cli.serve.configure_logs", lambda settings: None)  # the log of the tests stays theirs
    for name in ("WAYDROP_PORT", "WAYDROP_SERVER", "WAYDROP_TOKEN", "WAYDROP_CONNECTIONS", "WAYDROP_HOST"):
        monkeypatch.delenv(name, raising=False)


def plan_file(folder: Path, **changes: Any) -> Path:
    document = json.loads(GOOD.read_text())
    document.update(changes)
    file = folder / "plan.json"
    file.write_text(json.dumps(document))
    return file


def test_a_good_plan_ends_with_0_and_a_timeline_of_every_item(monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    assert status_of(monkeypatch, "validate", str(GOOD)) == 0
    shown = capsys.readouterr()
    for item in json.loads(GOOD.read_text())["items"]:
        assert item["id"] in shown.out
    assert "it can be flown" in shown.err


def test_a_plan_with_an_error_ends_with_1_and_its_rule_code(
    monkeypatch: pytest.MonkeyPatch, capsys: Capture, tmp_path: Path
) -> None:
    items = [item for item in json.loads(GOOD.read_text())["items"] if item["type"] != "waypoint"]
    assert status_of(monkeypatch, "validate", str(plan_file(tmp_path, items=items))) == 1
    shown = capsys.readouterr()
    assert "gripper.must_follow_waypoint" in shown.out
    assert "would be rejected" in shown.err


@pytest.mark.parametrize("text", ["", "{", "[]", '{"version": 1}', '{"version": NaN}'])
def test_a_file_that_is_no_plan_ends_with_2_and_a_pointer(
    monkeypatch: pytest.MonkeyPatch, capsys: Capture, tmp_path: Path, text: str
) -> None:
    file = tmp_path / "plan.json"
    file.write_text(text)
    assert status_of(monkeypatch, "validate", str(file)) == 2
    assert " at /" in capsys.readouterr().err


def test_an_unknown_field_is_named_by_its_pointer(
    monkeypatch: pytest.MonkeyPatch, capsys: Capture, tmp_path: Path
) -> None:
    assert status_of(monkeypatch, "validate", str(plan_file(tmp_path, nmae="x"))) == 2
    assert "plan.unknown_field at /nmae" in capsys.readouterr().err


def test_a_missing_file_ends_with_2(monkeypatch: pytest.MonkeyPatch, capsys: Capture, tmp_path: Path) -> None:
    assert status_of(monkeypatch, "validate", str(tmp_path / "none.json")) == 2
    assert "No such file" in capsys.readouterr().err


def test_json_is_one_document_on_stdout(monkeypatch: pytest.MonkeyPatch, capsys: Capture, tmp_path: Path) -> None:
    assert status_of(monkeypatch, "validate", "--json", str(GOOD)) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["timeline"]["order"]
    assert status_of(monkeypatch, "validate", "--json", str(plan_file(tmp_path, nmae="x"))) == 2
    assert json.loads(capsys.readouterr().out)["findings"][0]["pointer"] == "/nmae"


@pytest.mark.parametrize(
    "command",
    [
        ("vehicles",),
        ("runs",),
        ("runs", "show", "r1"),
        ("runs", "return", "r1"),
        ("runs", "change", "r1", "--at", "home"),
        ("runs", "insert", "r1", str(GOOD), "--after", "home"),
        ("fly", str(GOOD), "--vehicle", "v1"),
        ("validate", str(GOOD), "--vehicle", "v1"),
    ],
)
def test_without_a_service_every_client_ends_with_3(
    monkeypatch: pytest.MonkeyPatch, capsys: Capture, command: tuple[str, ...]
) -> None:
    monkeypatch.setenv("WAYDROP_SERVER", "http://127.0.0.1:9")
    assert status_of(monkeypatch, *command) == 3
    assert "Waydrop does not respond at http://127.0.0.1:9" in capsys.readouterr().err


def test_an_unusable_setting_ends_with_2_and_its_variable(monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    monkeypatch.setenv("WAYDROP_PORT", "none")
    assert status_of(monkeypatch, "serve") == 2
    assert "WAYDROP_PORT" in capsys.readouterr().err


def test_an_unusable_server_address_ends_with_2(monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    assert status_of(monkeypatch, "vehicles", "--server", "127.0.0.1:8080") == 2
    assert "http://127.0.0.1:8080" in capsys.readouterr().err


def test_listening_for_others_without_a_token_ends_with_2_and_says_what_to_do(
    monkeypatch: pytest.MonkeyPatch, capsys: Capture, tmp_path: Path
) -> None:
    monkeypatch.delenv("WAYDROP_BOOTSTRAP_TOKEN", raising=False)
    arguments = ("--host", "0.0.0.0", "--port", "18310", "--data-dir", str(tmp_path))
    assert status_of(monkeypatch, "serve", "--connection", "udpin://127.0.0.1:25910", *arguments) == 2
    assert "waydrop token create" in capsys.readouterr().err


def test_schema_and_openapi_are_json_documents(monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    assert status_of(monkeypatch, "schema") == 0
    assert json.loads(capsys.readouterr().out)["$schema"]
    assert status_of(monkeypatch, "openapi") == 0
    assert json.loads(capsys.readouterr().out)["openapi"].startswith("3.1")


def test_a_token_is_made_listed_and_revoked(monkeypatch: pytest.MonkeyPatch, capsys: Capture, tmp_path: Path) -> None:
    where = ("--data-dir", str(tmp_path))
    assert status_of(monkeypatch, "token", "create", "desk", "--role", "dispatcher", *where) == 0
    made = capsys.readouterr()
    assert made.out.startswith("wd_")
    token_id = made.err.split()[1]
    assert status_of(monkeypatch, "token", "revoke", token_id, *where) == 0
    capsys.readouterr()
    assert status_of(monkeypatch, "token", "list", *where) == 0
    listed = capsys.readouterr().out
    assert token_id in listed
    assert made.out.strip() not in listed
    assert status_of(monkeypatch, "token", "revoke", "nobody", *where) == 1


@pytest.fixture
def journal(tmp_path: Path) -> Path:
    """A folder with the journal of a service that has run once."""

    async def once() -> None:
        async with open_storage(tmp_path / "waydrop.db") as storage:
            await storage.events.append([NewEvent.of(ServiceStarted(release="1.0"), 1000.0)])

    asyncio.run(once())
    return tmp_path


def test_a_journal_as_written_ends_with_0_and_prints_the_anchor_to_keep(
    monkeypatch: pytest.MonkeyPatch, capsys: Capture, journal: Path
) -> None:
    assert status_of(monkeypatch, "verify-journal", "--data-dir", str(journal)) == 0
    shown = capsys.readouterr()
    assert "1 event, 0 plans, 0 runs: as written" in shown.err
    anchor = shown.out.strip()
    assert status_of(monkeypatch, "verify-journal", "--data-dir", str(journal), "--anchor", anchor) == 0


def test_an_altered_journal_ends_with_1_and_names_what_was_altered(
    monkeypatch: pytest.MonkeyPatch, capsys: Capture, journal: Path
) -> None:
    later = f"2:{'ab' * 32}"
    assert status_of(monkeypatch, "verify-journal", "--data-dir", str(journal), "--anchor", later) == 1
    shown = capsys.readouterr().err
    assert "event 2 existed and is missing" in shown
    assert "ALTERED: 1 alteration" in shown


@pytest.mark.parametrize("anchor", ["3:x", "abc", "0:" + "a" * 64, "", f"1:{'a' * 63}"])
def test_an_anchor_that_is_none_ends_with_2_and_is_repeated_as_typed(
    monkeypatch: pytest.MonkeyPatch, capsys: Capture, journal: Path, anchor: str
) -> None:
    assert status_of(monkeypatch, "verify-journal", "--data-dir", str(journal), "--anchor", anchor) == 2
    assert f"--anchor {anchor}: not of the form SEQ:HASH" in capsys.readouterr().err


def test_no_journal_to_verify_ends_with_2_and_says_where_it_looked(
    monkeypatch: pytest.MonkeyPatch, capsys: Capture, tmp_path: Path
) -> None:
    assert status_of(monkeypatch, "verify-journal", "--data-dir", str(tmp_path / "none")) == 2
    assert "there is no journal at" in capsys.readouterr().err


def test_the_list_of_commands_says_of_each_what_its_own_help_says(monkeypatch: pytest.MonkeyPatch) -> None:
    group = typer.main.get_group(app)
    context = group.make_context("waydrop", ["vehicles"])
    for name in group.list_commands(context):
        shown = group.get_command(context, name)
        _, command, _ = group.resolve_command(context, [name])
        assert shown is not None
        assert shown.help == inspect.cleandoc(command.help).split("\n\n")[0].replace("\n", " ")


def test_the_list_of_commands_is_shown_without_the_commands(tmp_path: Path) -> None:
    shown = (
        "import sys; from app.cli.main import app; app(['--help'], standalone_mode=False); print(sorted(sys.modules))"
    )
    said = subprocess.run((sys.executable, "-c", shown), cwd=ROOT, check=True, capture_output=True, text=True).stdout
    assert "verify-journal" in said
    assert not {"pydantic", "aiohttp", "shapely", "sqlalchemy", "mavsdk"} & set(said.split("'"))
