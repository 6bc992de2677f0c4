"""Device profiles: what an instrument makes of its signal beyond CiA 301.

One file per concept. A profile sits between the sample and the dictionary, or between the set
point and the command, and like every service it reads no clock and sends nothing. Which one a
node has follows from its EDS: the low word of 0x1000, and the profile's objects.
"""
