"""What is known of a vehicle, what it can do, and the port through which it is reached."""
