"""How each kind of vehicle moves: kinematic models with honest limits, no 6-DOF."""
