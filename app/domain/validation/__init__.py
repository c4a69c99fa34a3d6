"""What pydantic finds wrong with a document, told to the person who wrote it: `findings_of` is the one way to it."""

from app.domain.validation.findings import document_of, findings_of

__all__ = ["document_of", "findings_of"]
