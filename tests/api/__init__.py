"""The API over real sockets, on the real services with a SQLite file; only the vehicles are made up."""
