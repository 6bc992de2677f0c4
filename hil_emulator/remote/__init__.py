"""Remote control of a running emulator: HTTP and JSON on this machine, beside the loop."""
