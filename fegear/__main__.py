"""`python -m fegear`, the command line."""

from fegear.cli import main

main()
