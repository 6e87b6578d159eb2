"""A page that is closed while the server writes to it leaves no traceback in the terminal."""

import asyncio
import gc
import logging
from logging.handlers import BufferingHandler

import pytest

websocket = pytest.importorskip("tornado.websocket")
closed_pages = pytest.importorskip("gearchaos.explorer.closed_pages")


@pytest.fixture
def records():
    """Install the filters for one test; give the records that the loggers of the server pass on.

    The handler and the level belong to the loggers themselves: distributed, once it is imported,
    raises the level of bokeh's loggers and no longer hands their records to the root logger.
    """
    loggers = [logging.getLogger(name) for name in closed_pages.LOGGERS]
    before = [(list(one.filters), one.level) for one in loggers]
    handler = BufferingHandler(capacity=100)
    closed_pages.ignore_closed_pages()
    for one in loggers:
        one.addHandler(handler)
        one.setLevel(logging.WARNING)
    yield handler.buffer
    for one, (filters, level) in zip(loggers, before, strict=True):
        one.removeHandler(handler)
        one.filters[:] = filters
        one.setLevel(level)


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
def test_only_faults_of_tasks_are_logged(error, count, records):
    asyncio.run(fails(error))
    assert len(records) == count


def test_only_faults_of_the_server_are_logged(records):
    logger = logging.getLogger("bokeh.server.views.ws")
    logger.warning("Failed sending message as connection was closed")
    assert not records
    logger.warning("another message")
    assert len(records) == 1
