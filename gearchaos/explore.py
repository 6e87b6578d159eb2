"""Open a local page on a result: its diagram to zoom into, and the motion of any lane at a click.

The page is served to this machine alone, at the address that goes to stdout, until Ctrl-C; the
address in the browser is a link to what the page shows. Needs pip install gearchaos[explore].
"""

from argparse import Namespace
from collections.abc import Sequence
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from typing import Any

from gearchaos import plot
from gearchaos.command_line import Command
from gearchaos.errors import ConfigurationError, FigureError, FileError
from gearchaos.progress import say

PACKAGES = ("panel", "holoviews", "datashader")


def _explore(options: Namespace) -> None:
    import webbrowser
    from socket import create_server

    from gearchaos.explorer import HOST
    from gearchaos.figures.response import is_response
    from gearchaos.results.files.atomic_file import reason
    from gearchaos.results.reading.result import open_result
    from gearchaos.results.reading.tables import needed

    result = open_result(options.result)
    if is_response(result):
        raise ConfigurationError(
            f"{options.result}: is a response; python -m gearchaos.plot draws it"
        )
    try:
        with create_server((HOST, options.port)) as free:
            port = free.getsockname()[1]
    except OSError as error:
        rule = f"{reason(error)}; choose another port, or 0 for any that is free"
        raise ConfigurationError(f"--port {options.port}: {rule}") from error
    # Before datashader makes Numba ready: for which processor is then settled for all code.
    import gearchaos_kernels  # noqa: F401

    panel, *_ = (needed(package, "explore") for package in PACKAGES)
    from gearchaos.explorer.page import Page
    from gearchaos.explorer.policy import origins, protect

    panel.extension()
    server = panel.io.server.get_server(
        lambda: Page(result, options.result, _draw).view(),
        port=port,
        address=HOST,
        websocket_origin=origins(port),
        title=f"gearchaos: {options.result}",
        warm=True,
    )
    protect(application(server), port)
    server.start()
    address = f"http://{HOST}:{port}/"
    print(address, flush=True)
    say("Ctrl-C ends it")
    if not options.no_browser:
        webbrowser.open(address)
    server.io_loop.start()


def application(server: Any) -> Any:
    """Return the tornado application of a bokeh server, which bokeh keeps to itself.

    Raises FileError where there is none: a page that cannot be protected is not served.
    """
    from bokeh import __version__

    try:
        return server._tornado
    except AttributeError:
        text = "does not tell how requests of other sites are refused; install an older one"
        raise FileError(f"bokeh {__version__} {text}") from None


def _draw(arguments: Sequence[str]) -> None:
    said = StringIO()
    with redirect_stdout(StringIO()), redirect_stderr(said):
        code = plot.main([*arguments, "--quiet"])
    if code:
        raise FigureError(said.getvalue())


main = Command("explore", __doc__, _explore).start(__name__)
