"""Remote control of a running emulator: HTTP and JSON on this machine, by a separate process."""
