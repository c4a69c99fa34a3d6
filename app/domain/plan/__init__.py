"""The delivery plan: the document that a dispatcher writes, parsed strictly. Its items are in app/domain/items."""

from app.domain.plan.document import Plan, plan_hash
from app.domain.plan.parse import PlanInvalid, parse_data, parse_plan, plan_json_schema

__all__ = ["Plan", "PlanInvalid", "parse_data", "parse_plan", "plan_hash", "plan_json_schema"]
