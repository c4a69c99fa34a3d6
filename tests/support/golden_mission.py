"""The text of a golden file: everything that a plan was compiled to, one item a line, so that a change can be read."""

from __future__ import annotations

import json
import math
from pathlib import Path

from app.domain.mission import CompiledDrop, MissionItem
from app.domain.plan import parse_plan, plan_hash
from app.domain.plan.compiler import compile_plan
from app.domain.rules import default_facts
from tests.support.paths import ROOT

PLANS = sorted((ROOT / "plans").glob("*.json"))
GOLDEN = ROOT / "tests" / "data" / "golden"
RULES_PAGE = ROOT / "docs" / "reference" / "rules.md"
REASONS_PAGE = ROOT / "docs" / "reference" / "reasons.md"
ITEM_TYPES_OF_PAGE = ROOT / "web" / "src" / "features" / "plan" / "item-types.json"
REASON_WORDS = ROOT / "web" / "src" / "format" / "reasons.json"
OFFBOARD_PAGE = ROOT / "docs" / "reference" / "offboard.md"


def golden_path(plan: Path) -> Path:
    return GOLDEN / f"{plan.stem}.mission.json"


def golden_text(plan_file: Path) -> str:
    """The mission of a plan as JSON; NaN is null, commands and frames are named."""
    plan = parse_plan(plan_file.read_bytes())
    mission = compile_plan(plan, default_facts(plan.vehicle_type))
    parts = {
        "mission": [_item(item, mission.plan_item_of[item.seq]) for item in mission.items],
        "fence": [_item(item) for item in mission.fence],
        "rally": [_item(item) for item in mission.rally],
        "drops": [_drop(drop) for drop in mission.drops],
    }
    lines = [f'"plan_hash": "{plan_hash(plan)}"']
    for name, rows in parts.items():
        body = ",\n".join(f"    {json.dumps(row)}" for row in rows)
        lines.append(f'"{name}": [\n{body}\n  ]' if rows else f'"{name}": []')
    return "{\n" + ",\n".join(f"  {line}" for line in lines) + "\n}\n"


def _item(item: MissionItem, plan_item: str | None = None) -> dict[str, object]:
    row: dict[str, object] = {} if plan_item is None else {"plan_item": plan_item}
    return row | {
        "seq": item.seq,
        "frame": item.frame.name,
        "command": item.command.name,
        "params": _floats((item.param1, item.param2, item.param3, item.param4)),
        "x": item.x,
        "y": item.y,
        "z": item.z,
        "current": item.current,
        "autocontinue": item.autocontinue,
        "mission_type": item.mission_type.name,
    }


def _drop(drop: CompiledDrop) -> dict[str, object]:
    return {name: getattr(drop, name) for name in CompiledDrop.__slots__} | {
        "command": drop.command.name,
        "params": _floats(drop.params),
        "alternate": None if drop.alternate is None else _drop(drop.alternate),
    }


def _floats(values: tuple[float, ...]) -> list[float | None]:
    return [None if math.isnan(value) else value for value in values]
