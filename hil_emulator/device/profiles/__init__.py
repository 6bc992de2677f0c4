"""Device profiles: signal processing and state machines beyond CiA 301.

One file per concept. A profile is between the sample and the dictionary, or between the set point
and the command. Like every service it reads no clock and sends nothing. The EDS selects the profile
of a node: the low word of 0x1000, and the profile's objects.
"""
