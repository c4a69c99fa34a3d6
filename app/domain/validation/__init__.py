"""What pydantic finds wrong with a document, told to the person who wrote it: `findings_of` is the one way to it.

The first finding of a model takes longer, for its JSON Schema is made; `places_of` makes it ahead.
"""

from app.domain.validation.findings import document_of, findings_of
from app.domain.validation.places import places_of

__all__ = ["document_of", "findings_of", "places_of"]
