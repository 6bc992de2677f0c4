"""A user's own machine: what to ask, what data sheets say, and the configuration that follows.

What data sheets do not print has a usual value, computed from the machine's size, with its reason.
"""
