"""``python -m petcomp``: the program."""

from ._program import main

main()
