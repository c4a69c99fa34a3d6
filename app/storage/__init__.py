"""The journal and the plans on disk: the only importer of SQLAlchemy."""

from app.storage.database import no_journal
from app.storage.storage import Storage, open_flight_log, open_storage, open_tokens
from app.storage.verify import Verification, verify_journal

__all__ = ["Storage", "Verification", "no_journal", "open_flight_log", "open_storage", "open_tokens", "verify_journal"]
