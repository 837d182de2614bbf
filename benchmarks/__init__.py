"""How fast the solver is, measured: against marks, against other programs, and against the memory of the machine.

``python -m benchmarks`` writes ``results/benchmarks.json`` and prints the table of the README.
"""
