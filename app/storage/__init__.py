"""The journal and the plans on disk: the only importer of SQLAlchemy."""

from app.storage.storage import Storage, open_storage, open_tokens

__all__ = ["Storage", "open_storage", "open_tokens"]
