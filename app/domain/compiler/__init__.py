"""The compiler: plan -> MISSION_ITEM_INT."""

from app.domain.compiler.compile import compile_plan

__all__ = ["compile_plan"]
