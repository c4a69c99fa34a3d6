"""The cluster's store in PostgreSQL: the only importer of asyncpg."""

from app.storage.postgres.storage import ClusterStorage, open_cluster_storage

__all__ = ["ClusterStorage", "open_cluster_storage"]
