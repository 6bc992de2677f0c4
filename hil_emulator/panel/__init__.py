"""The panel: the live bench in a browser, served by a process beside the loop."""
