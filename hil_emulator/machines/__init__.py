"""A user's machine: questions, data sheets of valves, and the resulting configuration.

Values that data sheets do not state have usual values, computed from the machine's size, each with
its reason.
"""
