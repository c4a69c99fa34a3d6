"""`waydrop convert`: the result on stdout or in a file, every loss on stderr, the exit status says whether."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

from app.cli.main import main
from app.domain.plan import parse_plan
from tests.support.paths import ROOT

CLINIC = ROOT / "plans" / "clinic-run.json"
FILES = ROOT / "tests" / "data" / "interchange"
Capture = pytest.CaptureFixture[str]


@pytest.fixture(autouse=True)
def _wide_and_plain(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.setenv("NO_COLOR", "1")


def convert(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int:
    monkeypatch.setattr(sys, "argv", ["waydrop", "convert", *arguments])
    with pytest.raises(SystemExit) as ended:
        main()
    return int(ended.value.code or 0)


def test_a_plan_file_becomes_a_plan_named_after_its_file(monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    assert convert(monkeypatch, str(FILES / "multicopter-delivery.plan"), "--to", "plan") == 0
    shown = capsys.readouterr()
    assert parse_plan(shown.out).name == "multicopter-delivery"
    assert "assumed conversion.release_motion at /mission/items/2" in shown.err


def test_a_plan_goes_through_a_plan_file_and_comes_back_equal(
    monkeypatch: pytest.MonkeyPatch, capsys: Capture, tmp_path: Path
) -> None:
    file = tmp_path / "out.plan"
    assert convert(monkeypatch, str(CLINIC), "--to", "qgc", "--output", str(file)) == 0
    assert "lost conversion.supervision at /items/3" in capsys.readouterr().err
    assert convert(monkeypatch, str(file), "--to", "plan") == 0
    assert parse_plan(capsys.readouterr().out) == parse_plan(CLINIC.read_bytes())


@pytest.mark.parametrize(("target", "begins"), [("geojson", "{"), ("kml", "<?xml"), ("qgc", "{")])
def test_a_waypoint_file_can_become_anything(
    monkeypatch: pytest.MonkeyPatch, capsys: Capture, target: str, begins: str
) -> None:
    assert convert(monkeypatch, str(FILES / "mission-planner.waypoints"), "--to", target) == 0
    assert capsys.readouterr().out.startswith(begins)


def test_a_survey_ends_with_2_and_its_name(monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    assert convert(monkeypatch, str(FILES / "survey.plan"), "--to", "plan") == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert "'survey'" in shown.err
    assert "cannot be converted to a plan" in shown.err


def test_a_file_that_says_no_vehicle_takes_the_one_that_is_said(
    monkeypatch: pytest.MonkeyPatch, capsys: Capture, tmp_path: Path
) -> None:
    document = json.loads((FILES / "rover-delivery.plan").read_text())
    document["mission"]["vehicleType"] = 0
    file = tmp_path / "rover.plan"
    file.write_text(json.dumps(document))
    arguments = ("--to", "plan", "--vehicle-type", "rover", "--name", "Yard")
    assert convert(monkeypatch, str(file), *arguments) == 0
    plan = parse_plan(capsys.readouterr().out)
    assert (plan.name, plan.vehicle_type.value) == ("Yard", "rover")


def test_a_file_that_cannot_be_read_or_written_ends_with_2(
    monkeypatch: pytest.MonkeyPatch, capsys: Capture, tmp_path: Path
) -> None:
    assert convert(monkeypatch, str(tmp_path / "none.plan"), "--to", "plan") == 2
    assert "No such file" in capsys.readouterr().err
    assert convert(monkeypatch, str(CLINIC), "--to", "kml", "--output", str(tmp_path / "no" / "x.kml")) == 2
    assert "No such file" in capsys.readouterr().err


@pytest.mark.parametrize("way", ["same", "roundabout", "symlink", "hardlink"])
def test_the_source_is_never_written_over(
    monkeypatch: pytest.MonkeyPatch, capsys: Capture, tmp_path: Path, way: str
) -> None:
    source = tmp_path / "delivery.plan"
    content = (FILES / "multicopter-delivery.plan").read_bytes()
    source.write_bytes(content)
    output = {"same": source, "roundabout": tmp_path / "." / ".." / tmp_path.name / source.name}.get(
        way, tmp_path / "link.plan"
    )
    if way == "symlink":
        output.symlink_to(source)
    elif way == "hardlink":
        output.hardlink_to(source)
    assert convert(monkeypatch, str(source), "--to", "kml", "--output", str(output)) == 2
    assert "is the input file" in capsys.readouterr().err
    assert source.read_bytes() == content


def test_a_file_may_be_called_anything(monkeypatch: pytest.MonkeyPatch, capsys: Capture, tmp_path: Path) -> None:
    file = tmp_path / ("n" * 240 + ".plan")
    file.write_bytes((FILES / "multicopter-delivery.plan").read_bytes())
    assert convert(monkeypatch, str(file), "--to", "plan") == 0
    assert parse_plan(capsys.readouterr().out).name == "n" * 200
