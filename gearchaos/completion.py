"""Print what makes the tab key of a shell complete the commands, their options and files.

For bash: gearchaos completion bash > ~/.local/share/bash-completion/completions/gearchaos; for zsh:
gearchaos completion zsh > a file named _gearchaos in a folder of $fpath. Needs pip install
gearchaos[completion].
"""

from argparse import ArgumentParser, Namespace
from importlib import import_module

from gearchaos.command_line import COMMANDS, OK, Command, module_of


def _arguments(parser: ArgumentParser) -> None:
    parser.add_argument("shell", choices=("bash", "zsh"), help="which shell it is for")


def _complete(options: Namespace) -> int:
    from gearchaos.results.tables import needed

    shtab = needed("shtab", "completion")
    whole = ArgumentParser(prog="gearchaos")
    parsers = whole.add_subparsers()
    for name, text in COMMANDS.items():
        own = import_module(module_of(name)).main.parser()
        for action in own._actions:
            if action.choices:
                action.choices = list(action.choices)
            elif "." in (metavar := str(action.metavar)) or metavar == "PATH":
                action.complete = shtab.FILE
        parsers.add_parser(name, help=text, parents=[own], add_help=False)
    print(shtab.complete(whole, options.shell))
    return OK


main = Command("completion", __doc__, _arguments, _complete, writes=False)
main.start(__name__)
