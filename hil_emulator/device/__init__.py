"""The CANopen device that exposes the model: a CiA 301 slave made of small services.

One file per service of CiA 301 (SDO, NMT, PDO, SYNC, EMCY, error control), put together in
`node`. Frames and the time go in, frames and set points come out: nothing in here reads a clock,
starts a thread, opens a file after start-up or knows what hydraulics is. The services share one
thing, the object dictionary, where every object has exactly one value.
"""
