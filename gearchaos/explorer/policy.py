"""Rules for the requests that the page answers, and for the use of its answers by a browser.

A page of another site in the same browser can send requests to this machine. The browser adds
``Origin`` to the requests of scripts and ``Sec-Fetch-Site`` to all requests, and a site can change
neither. A link opened by a person is always answered.
"""

from typing import Any
from urllib.parse import urlsplit

from panel.util import parse_query
from tornado.httputil import HTTPHeaders, HTTPServerRequest
from tornado.routing import Matcher, Rule
from tornado.web import Application, ErrorHandler, HTTPError, OutputTransform, RequestHandler

from gearchaos.explorer import HOST

NAMES = (HOST, "localhost")
"""Names of this machine under which the page is served."""


def origins(port: int) -> list[str]:
    """Return the hosts under which the page is served, with the port."""
    # Browsers omit port 80.
    return [f"{name}:{port}" for name in NAMES] + (list(NAMES) if port == 80 else [])


def protect(application: Application, port: int) -> None:
    """Reject requests of other sites with code 403, and send a policy with every answer.

    Parameters
    ----------
    application : Application
        The server's application, which is changed.
    port : int
        Port of the server.
    """
    refused = Rule(_Foreign(port), ErrorHandler, {"status_code": 403})
    application.default_router.rules[:0] = [refused, Rule(_Unreadable(), _BadLink)]
    application.transforms.append(_policy(port))


class _Foreign(Matcher):  # type: ignore[misc]
    """Matches requests for another host and requests from a page of another site."""

    def __init__(self, port: int) -> None:
        self._port = port

    def match(self, request: HTTPServerRequest) -> dict[str, Any] | None:
        """Return an empty mapping where the request is foreign, None otherwise."""
        headers, own = request.headers, origins(self._port)
        # Another site can let its own name resolve to this address: check the host.
        foreign = request.host.lower() not in own
        if "Origin" in headers:
            foreign |= headers["Origin"].lower() not in [f"http://{name}" for name in own]
        opened = headers.get("Sec-Fetch-Mode"), headers.get("Sec-Fetch-Dest")
        if opened != ("navigate", "document"):
            foreign |= headers.get("Sec-Fetch-Site") in ("cross-site", "same-site")
        return {} if foreign else None


class _Unreadable(Matcher):  # type: ignore[misc]
    """Matches links that panel fails to parse, such as a number of 5,000 digits."""

    def match(self, request: HTTPServerRequest) -> dict[str, Any] | None:
        """Return an empty mapping where the link cannot be read, None otherwise."""
        try:
            parse_query(f"?{urlsplit(request.uri or '').query}")
        except (ValueError, RecursionError):
            return {}
        return None


class _BadLink(RequestHandler):  # type: ignore[misc]
    def prepare(self) -> None:
        """Answer with code 400 and a remedy."""
        raise HTTPError(400, reason="the link cannot be read: open the address without it")


def _policy(port: int) -> type[OutputTransform]:
    sockets = " ".join(f"ws://{name}" for name in origins(port))
    content = {
        "default-src": "'self'",
        # Panel starts its page from an inline script, compiles templates in the browser, and uses
        # inline styles.
        "script-src": "'self' 'unsafe-inline' 'unsafe-eval' blob:",
        "style-src": "'self' 'unsafe-inline'",
        "img-src": "'self' data: blob:",
        "font-src": "'self' data:",
        "connect-src": f"'self' {sockets}",
        "object-src": "'none'",
        "base-uri": "'none'",
        "form-action": "'none'",
        "frame-ancestors": "'none'",
    }
    sent = {
        "Content-Security-Policy": "; ".join(f"{name} {rule}" for name, rule in content.items()),
        "X-Frame-Options": "DENY",
        "X-Content-Type-Options": "nosniff",
        "Cross-Origin-Resource-Policy": "same-origin",
        "Referrer-Policy": "no-referrer",
    }

    class Policy(OutputTransform):  # type: ignore[misc]
        """Adds the policy to an answer, and removes the access that bokeh grants to all sites."""

        def transform_first_chunk(
            self,
            status_code: int,
            headers: HTTPHeaders,
            chunk: bytes,
            finishing: bool,  # noqa: ARG002
        ) -> tuple[int, HTTPHeaders, bytes]:
            for name in [name for name in headers if name.startswith("Access-Control-")]:
                del headers[name]
            for name, value in sent.items():
                headers[name] = value
            return status_code, headers, chunk

    return Policy
