"""The rig's CAN port: everything that touches python-can, and nothing else does.

`bus.Bus` hands frames in and out without ever making the loop wait; `tcp_server` is a bus of its
own for machines whose kernel has no CAN, to which stock python-can clients connect over TCP.
"""
