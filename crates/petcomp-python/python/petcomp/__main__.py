"""``python -m petcomp`` runs the program."""

from ._program import main

main()
