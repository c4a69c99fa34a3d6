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

| code | severity | why | source |
|---|---|---|---|
"""


def rules_page() -> str:
    """Markdown: one line a rule, in the order in which they are checked."""
    return _HEAD + "".join(_line(rule) for rule in RULES)


def _line(rule: Rule) -> str:
    cells = (f"`{rule.code}`", str(rule.severity), rule.reason, rule.source)
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |\n"
