"""Another plant behind our instruments: an FMU in a process of its own."""
