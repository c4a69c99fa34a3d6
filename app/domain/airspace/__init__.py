"""Where a vehicle may fly: the geofence, the paths over the ground, the rally points."""
