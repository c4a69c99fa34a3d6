"""What is true about plans, missions, drops and vehicles. Pure: no I/O, no asyncio."""
