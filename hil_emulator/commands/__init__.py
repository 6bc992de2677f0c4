"""The actions of the command line, one file per command, imported when a command is called."""
