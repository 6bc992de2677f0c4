"""The protocol of control port and panel: every request, its arguments, limits and answer.

A request is a JSON object; `do` names it. The control port takes it as HTTP, the panel's stream as
a WebSocket message; their processes pass what acts on the rig to the loop. The page of the
documentation and the JSON Schema are generated from these declarations.
"""
