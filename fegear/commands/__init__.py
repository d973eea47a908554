"""Commands, a folder each: deleting it deletes the command, and nothing else."""
