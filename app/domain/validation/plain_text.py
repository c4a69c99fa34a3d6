"""For names and notes that users give, behind the limits of their length: what cannot be seen is refused."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any, Final

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from app.domain.text import UNSEEN_IN_LINE, UNSEEN_IN_LINES, UNSEEN_TAGS


@dataclass(frozen=True, slots=True)
class Without:
    """Annotates a string that must not contain these characters, nor tag characters. A name has any that is seen."""

    unseen: str
    is_name: bool = False

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        pattern = re.compile(f"[{self.unseen}{UNSEEN_TAGS}]")

        def check(text: str | None) -> str | None:
            found = None if text is None else pattern.search(text)
            if found is None and self.is_name and text is not None and text.isspace():
                raise PydanticCustomError("unprintable", "must contain more than spaces")
            if found is None:
                return text
            raise PydanticCustomError(
                "unprintable",
                "must not contain control characters or invisible formatting, as U+{code} at character {place}",
                {"code": f"{ord(found[0]):04X}", "place": found.start() + 1},
            )

        return core_schema.no_info_after_validator_function(check, handler(source))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return {**handler(schema), "pattern": f"^[^{self.unseen}]*$"}


PLAIN_LINE: Final = Without(UNSEEN_IN_LINE)
"""One line without control characters, bidirectional overrides and the like."""
PLAIN_NAME: Final = Without(UNSEEN_IN_LINE, is_name=True)
"""The same, and not only spaces."""
PLAIN_TEXT: Final = Without(UNSEEN_IN_LINES)
"""The same with line breaks and tabs."""
