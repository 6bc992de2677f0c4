"""Measured data on the way in: files, channels, one time grid, and what is wrong with them."""
