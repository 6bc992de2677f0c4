"""The plant with its sensors as an FMU for co-simulation that needs no Python."""
