"""fegear rattle: machines that may rattle, a file per command."""
