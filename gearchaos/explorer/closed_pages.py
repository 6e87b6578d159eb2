"""Messages of the server about pages that the browser has closed: they report no fault."""

import logging

from tornado.websocket import WebSocketClosedError

LOGGERS = "asyncio", "bokeh.server.views.ws"
"""Loggers that report a page that was closed while the server was writing to it."""


def ignore_closed_pages() -> None:
    """Leave out log messages about closed pages; all other messages of the server remain."""
    for name in LOGGERS:
        logging.getLogger(name).addFilter(_reports_a_fault)


def _reports_a_fault(record: logging.LogRecord) -> bool:
    """Whether a message is about something else than a closed page."""
    error = record.exc_info[1] if record.exc_info else None
    closed = isinstance(error, WebSocketClosedError)
    return not (closed or "connection was closed" in record.getMessage())
