"""The explorer: a web page with diagrams to zoom into, and the motion of the clicked lane."""

HOST = "127.0.0.1"
"""Address of the page: the loopback interface, which other machines cannot reach."""
