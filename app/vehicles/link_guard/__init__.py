"""The guard of the vehicle links: whole MAVLink frames between vehicles and mavsdk, judged one by one."""
