"""The rules: what makes a plan wrong or doubtful, before anything is sent."""

from app.domain.default_facts import default_facts
from app.domain.finding import Finding, Severity
from app.domain.rules.check import RULES, CheckedPlan, check_plan, checked
from app.domain.rules.registry import Rule

__all__ = ["RULES", "CheckedPlan", "Finding", "Rule", "Severity", "check_plan", "checked", "default_facts"]
