"""The page of all rules, made from the rules themselves."""

from __future__ import annotations

from app.domain.rules.check import RULES
from app.domain.rules.registry import Rule

_HEAD = """# Rules

<!-- Generated from app/domain/rules; `python -m tests.unit.domain.regenerate` writes it anew. -->

Every plan is checked against all of these before anything is sent, and all findings are returned at once, each with
its code, a JSON pointer into the plan, a sentence and a hint. An **error** stops the plan; a **warning** is shown and
kept with the run. Codes are stable. Codes that begin with `plan.` are about the document itself: see
[plan-format.md](plan-format.md). "Flown" means: seen on PX4 main (v1.18) in SITL.

## What is assumed

Many rules need facts of the vehicle: parameters, firmware, home, how much it stores. A finding that rests on facts that
are not known lists them in `assumed`.

- **No vehicle is named** (`POST /plans`, `waydrop validate` without `--vehicle`): PX4's defaults are assumed, and a
  finding that rests on them is a warning that begins with "depends on the vehicle:". The plan is refused only for what
  no vehicle could fly. A run, a job or a check with a vehicle decides by what that one tells. `home` of the plan counts
  as known.
- **A vehicle is named and does not tell a fact**: PX4's default is assumed (where firmware versions differ, what the
  rule says), and the finding stays an error: a plan that is accepted for a vehicle must be accepted by it. The sentence
  says what was assumed. A parameter that does not answer refuses nothing by itself, for old firmware lacks some.
- **Nobody knows home**: heights of absolute altitudes are not checked, and that is said
  (`vehicle.altitudes_not_comparable`). A vehicle without a home is refused (`vehicle.home_unknown`).

## All rules

| code | severity | why | source |
|---|---|---|---|
"""


def rules_page() -> str:
    """Markdown: one line a rule, in the order in which they are checked."""
    return _HEAD + "".join(_line(rule) for rule in RULES)


def _line(rule: Rule) -> str:
    cells = (f"`{rule.code}`", str(rule.severity), rule.reason, rule.source)
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |\n"
