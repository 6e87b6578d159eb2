"""Print what makes the tab key of a shell complete the commands, their options and files.

For bash: gearchaos completion bash > ~/.local/share/bash-completion/completions/gearchaos; for zsh:
gearchaos completion zsh > a file named _gearchaos in a folder of $fpath. Needs pip install
gearchaos[completion].
"""

from argparse import ArgumentParser, Namespace
from importlib import import_module

from gearchaos.command_line import COMMANDS, Command


def _complete(options: Namespace) -> None:
    from gearchaos.results.reading.tables import needed

    shtab = needed("shtab", "completion")
    whole = ArgumentParser(prog="gearchaos")
    parsers = whole.add_subparsers()
    for name, about in COMMANDS.items():
        own = import_module(f"gearchaos.{name}").main.parser()
        for action in own._actions:
            if action.choices:
                action.choices = list(action.choices)
            elif "." in (metavar := str(action.metavar)) or metavar == "PATH":
                action.complete = shtab.FILE
        parsers.add_parser(name, help=about["summary"], parents=[own], add_help=False)
    print(shtab.complete(whole, options.shell))


main = Command("completion", __doc__, _complete).start(__name__)
