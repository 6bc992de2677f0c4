"""The rig's CAN port, the only folder that uses python-can's buses, logs and messages.

`bus.Bus` receives and sends frames without blocking the loop. `tcp_server` is a bus for machines
whose kernel has no CAN; stock python-can clients connect to it over TCP.
"""
