"""The panel: a running emulator in a browser, served by a separate process."""
