"""Benches that are less than an actuator, simulated by formulas of their own."""
