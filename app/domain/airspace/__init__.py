"""Where a vehicle may fly: geofence, return paths and rally points."""
