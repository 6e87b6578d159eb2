"""A page that is closed while the server writes to it leaves no traceback in the terminal."""

import asyncio
import gc
import logging

import pytest

websocket = pytest.importorskip("tornado.websocket")
closed_pages = pytest.importorskip("gearchaos.explorer.closed_pages")


@pytest.fixture(autouse=True)
def filters():
    """Install the filters, and remove them after the test."""
    loggers = [logging.getLogger(name) for name in closed_pages.LOGGERS]
    before = [list(one.filters) for one in loggers]
    closed_pages.ignore_closed_pages()
    yield
    for one, some in zip(loggers, before, strict=True):
        one.filters[:] = some


async def fails(error):
    """Start a task that ends in an error which no code retrieves."""

    async def task():
        raise error

    asyncio.ensure_future(task())  # noqa: RUF006
    await asyncio.sleep(0.01)
    gc.collect()


@pytest.mark.parametrize(
    ("error", "count"), [(websocket.WebSocketClosedError(), 0), (ValueError("a fault"), 1)]
)
def test_only_faults_of_tasks_are_logged(error, count, caplog):
    asyncio.run(fails(error))
    assert len(caplog.records) == count


def test_only_faults_of_the_server_are_logged(caplog):
    logger = logging.getLogger("bokeh.server.views.ws")
    logger.warning("Failed sending message as connection was closed")
    assert not caplog.records
    logger.warning("another message")
    assert len(caplog.records) == 1
