"""The rules that a plan is checked against before anything is sent to a vehicle."""

from app.domain.autopilot.declared import default_facts
from app.domain.rules.check import RULES, CheckedPlan, check_plan, checked
from app.domain.rules.registry import Rule
from app.domain.validation.finding import Finding, Severity

__all__ = ["RULES", "CheckedPlan", "Finding", "Rule", "Severity", "check_plan", "checked", "default_facts"]
