"""Run time against error, a file for each benchmark."""
