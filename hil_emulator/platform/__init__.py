"""The computer: paths of files, memory, processes, output files and clusters."""
