"""The physics: servo valve, cylinder, oil, friction, load and sensors.

Knows neither CAN nor configuration, files or clocks. What it computes follows from its
arguments alone; random numbers are handed in.
"""
