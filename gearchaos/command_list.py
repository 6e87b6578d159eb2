"""Names of all commands, each with the line that ``gearchaos --help`` prints for it."""

COMMANDS = {
    "sweep": "compute a sweep from a configuration file",
    "plot": "draw a result file",
    "report": "write a page with figures, tables and a glossary of a result",
    "explore": "open a local page to explore a result",
    "stages": "list the stages of a sweep and refine their boundaries",
    "basins": "find the attractors of a sweep from many starts, and their basins",
    "shares": "print the shares of motions among drawn gear pairs or starts",
    "branches": "follow periodic orbits as whole branches, stable and unstable",
    "boundaries": "follow folds, period doublings and grazing over two parameters",
    "control": "keep a gear pair on a periodic orbit by its load",
    "response": "compute the motion at every step of some mesh periods",
    "reproduce": "compute, draw and compare all results of a paper",
    "info": "show the contents of a result file and verify it",
    "identify": "fit parameters of a pair to its observed diagram",
    "accuracy": "measure error and time of step sizes on some lanes of a sweep",
    "merge": "join the shards of a sweep that several jobs have computed",
    "export": "write a result as CSV, Parquet or for MATLAB",
    "example": "list the ready-made configurations, or copy one",
    "schema": "print the JSON Schema of a configuration file, or all of its keys",
    "completion": "print a script for the tab key of bash or zsh",
}
"""The command NAME is the object ``main`` of the module ``gearchaos.NAME``.

Listed here, because importing 20 modules would slow down every start.
"""
