"""Partners on the bus that are not CANopen: nodes described by a DBC, with or without J1939.

cantools packs and unpacks; `crccheck` and `autosar-e2e` compute checksums. Without input, output
and clock, as `device` is: time, frames and samples come in, frames and commands go out.
"""
