"""Predictors of rigs that are not a complete actuator, chosen by `instrumentation`."""
