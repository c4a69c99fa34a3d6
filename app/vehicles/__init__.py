"""The MAVLink side: the only importer of mavsdk."""
