"""The steps that make the tables of a cluster."""
