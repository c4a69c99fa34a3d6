"""Converts pydantic errors to findings for the author of a document. The entry point is `findings_of`.

The first call for a model builds its JSON Schema, which is slow; `places_of` does so ahead of time.
"""

from app.domain.validation.findings import document_of, findings_of
from app.domain.validation.places import places_of

__all__ = ["document_of", "findings_of", "places_of"]
