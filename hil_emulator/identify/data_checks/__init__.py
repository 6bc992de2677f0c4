"""What in measured data contradicts physics, units, or one clock, before anything is fitted."""
