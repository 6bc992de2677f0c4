"""Checks of measured data before a fit: physics, signs, units, clocks and repeated noise."""
