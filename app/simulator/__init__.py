"""Vehicles made of software that speak MAVLink over UDP: the only importer of pymavlink."""
