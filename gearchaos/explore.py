"""Open a local page to explore a result: zoom into its diagram, click a lane to see its motion.

Only this machine can open the page. Its address goes to stdout, and Ctrl-C ends the command. The
address in the browser is a link to the current view.

--branches and --boundaries draw what `plot` draws with them, and a switch shows or hides it. The
pointer at a special point shows what happens there.

--save writes an interactive page instead: diagram with stages and exponents, map, or basins, of at
most 5 MB, for readers without the program. It has no motions of lanes.

Needs more packages: pip install "gearchaos[explore]".
"""

from collections.abc import Sequence
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from gearchaos import basins, plot
from gearchaos.command_line import Command
from gearchaos.errors import ConfigurationError, FigureError, FileError
from gearchaos.options import Option, Overwrite, Place, ResultFile, Units, placed_coordinates
from gearchaos.progress import say

if TYPE_CHECKING:
    from gearchaos.results.reading.result import Result

PORTS = 20
"""Most ports that are tried, from the wanted one on."""

PACKAGES = ("panel", "holoviews", "datashader")

PATIENCE = 1800
"""Seconds for which the server keeps a page that a browser has begun to load."""


class ExploreOptions(NamedTuple):
    """Options of ``gearchaos explore``."""

    result: ResultFile
    port: Annotated[
        int,
        Option(
            "port of the page, or the next free one; 0 takes any free port (default: %(default)s)",
            "N",
            low=0,
            high=65535,
        ),
    ] = 5006
    no_browser: Annotated[bool, Option("print the address, but do not open a browser")] = False
    save: Annotated[
        str | None,
        Option(
            "write an interactive page to this file, and do not serve one", "PAGE.html", file=True
        ),
    ] = None
    branches: Annotated[
        str | None,
        Option(
            "draw the branches of this file of gearchaos branches into the diagram, with a switch",
            "BRANCHES.h5",
            file=True,
        ),
    ] = None
    boundaries: Annotated[
        str | None,
        Option(
            "draw the curves of this file of gearchaos boundaries over the map, with a switch",
            "BOUNDARIES.h5",
            file=True,
        ),
    ] = None
    at: Annotated[
        tuple[Place, ...],
        Option("with --save: use the nearest value of this axis; may be repeated", "NAME=VALUE"),
    ] = ()
    units: Units = None
    overwrite: Overwrite = False


def _explore(options: ExploreOptions) -> None:
    import webbrowser

    from gearchaos.explorer import HOST
    from gearchaos.figures.response import is_response
    from gearchaos.results.reading.result import open_result
    from gearchaos.results.reading.tables import needed

    result = open_result(options.result)
    if is_response(result):
        raise ConfigurationError(
            f"{options.result}: is a response; python -m gearchaos.plot draws it"
        )
    if options.save is not None:
        _save(result, options)
        return
    # Must be imported before datashader uses Numba, which settles the processor for all code.
    import gearchaos_kernels  # noqa: F401

    panel, *_ = (needed(package, "explore") for package in PACKAGES)
    port = _free_port(HOST, options.port)
    from gearchaos.explorer.closed_pages import ignore_closed_pages
    from gearchaos.explorer.overlay import read_overlaid
    from gearchaos.explorer.page import ExplorerPage
    from gearchaos.explorer.policy import origins, protect

    given = (options.branches, options.boundaries)
    overlaid = read_overlaid(result, options.result, given, options.units)
    panel.extension()
    server = panel.io.server.get_server(
        lambda: ExplorerPage(result, options.result, _draw, overlaid).view(),
        port=port,
        address=HOST,
        websocket_origin=origins(port),
        title=f"gearchaos: {options.result}",
        warm=True,
        # On a busy machine, a browser may take minutes between its first request and the next.
        unused_session_lifetime_milliseconds=1000 * PATIENCE,
        session_token_expiration=PATIENCE,
    )
    protect(application(server), port)
    ignore_closed_pages()
    server.start()
    address = f"http://{HOST}:{port}/"
    print(address, flush=True)
    say("Ctrl-C ends it")
    if not options.no_browser:
        webbrowser.open(address)
    server.io_loop.start()


def _save(result: "Result", options: ExploreOptions) -> None:
    """Write the page of --save.

    Panel stays out: bokeh would add its scripts to the page, by name and not as text.
    """
    from gearchaos.results.reading.tables import needed

    needed("bokeh", "explore")
    from gearchaos.explorer.overlay import read_overlaid
    from gearchaos.explorer.starts import start_grid
    from gearchaos.explorer.static import static_page
    from gearchaos.finishing import output_of
    from gearchaos.outputs.names import START
    from gearchaos.results.files.atomic_file import check_output, replacing
    from gearchaos.results.reading.physical_units import in_units

    for path in filter(None, (options.branches, options.boundaries, options.result)):
        output = output_of(options.save, path, ".html")
    check_output(output, options.overwrite)
    part = result.sel("within", **placed_coordinates(options.at, result.axes, result.axis))
    given = (options.branches, options.boundaries)
    overlaid = read_overlaid(part, options.result, given, options.units)
    grid, found = start_grid(part, options.result), None
    if grid and grid.has_basins and len(grid.axes) == 2:
        others = [axis for axis in part.axes if axis != START]
        if several := [axis for axis in others if part[axis].size > 1]:
            where = " ".join(f"--at {axis}={part[axis][0]:g}" for axis in several)
            say(f"basins are drawn at one value of each parameter, such as with {where}")
        else:
            place = {axis: float(part[axis][0]) for axis in others}
            found = grid.basins(place, options.units or "")
            part = grid.result.sel(None, **place)
    content = static_page(in_units(part, options.units, physical=False), found, overlaid)
    with replacing(output, overwrite=options.overwrite) as partial:
        partial.write_text(content, encoding="utf-8")
    print(output, flush=True)


def _free_port(host: str, wanted: int) -> int:
    """Return the wanted port, or the next free one; for 0, any free one.

    Raises ConfigurationError if the port may not be used, or none of the next ones is free.
    """
    from errno import EADDRINUSE
    from socket import create_server

    from gearchaos.results.files.atomic_file import reason

    for number in range(wanted, min(wanted + PORTS, 65_536)):
        try:
            with create_server((host, number)) as free:
                port: int = free.getsockname()[1]
        except OSError as error:
            if error.errno == EADDRINUSE and number + 1 < min(wanted + PORTS, 65_536):
                continue
            rule = f"{reason(error)}; choose another port, or 0 for any that is free"
            raise ConfigurationError(f"--port {wanted}: {rule}") from error
        if port != wanted and wanted:
            say(f"port {wanted} is in use, the page is at port {port}")
        break
    return port


def application(server: Any) -> Any:
    """Return the tornado application of a bokeh server, a private attribute of it.

    Raises FileError if it is missing: a page that cannot be protected is not served.
    """
    from bokeh import __version__

    try:
        return server._tornado
    except AttributeError:
        text = "gives no way to refuse requests of other sites; install an older version"
        raise FileError(f"bokeh {__version__} {text}") from None


def _draw(arguments: Sequence[str]) -> None:
    """Run `plot` or `basins`, the first argument; raise a FigureError with its messages."""
    command, *options = arguments
    said = StringIO()
    with redirect_stdout(StringIO()), redirect_stderr(said):
        code = {"plot": plot, "basins": basins}[command].main([*options, "--quiet"])
    if code:
        raise FigureError(said.getvalue())


main = Command("explore", __doc__, ExploreOptions, _explore, writes=False).start(__name__)
