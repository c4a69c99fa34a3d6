"""The cluster's store in PostgreSQL: the only importer of asyncpg."""

from app.storage.postgres.storage import ClusterStorage, open_cluster_storage
from app.storage.postgres.verify import verify_cluster

__all__ = ["ClusterStorage", "open_cluster_storage", "verify_cluster"]
