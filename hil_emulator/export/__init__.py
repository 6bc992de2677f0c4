"""What other tools read: EDS and DCF of each node, a DBC of each bus.

Made from the nodes as they are configured, not from their EDS files: defaults, mappings, units
and scaling are those the emulator has at power-up.
"""
