"""`python -m gainful.cli`."""

from . import main

main()
