"""The guard of the vehicle links: whole MAVLink frames between the open side and mavsdk, judged one by one."""
