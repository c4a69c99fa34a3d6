"""The journal and the plans on disk: the only importer of SQLAlchemy."""
