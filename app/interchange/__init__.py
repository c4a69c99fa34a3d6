"""Plans in the formats of other software: read from QGroundControl and Mission Planner, written for maps too. Pure."""
