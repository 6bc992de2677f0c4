"""Compiled equations of the Kalman filter, its smoother and the free run, used by the observer."""
