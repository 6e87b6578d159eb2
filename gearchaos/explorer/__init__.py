"""The page of a result: diagrams to zoom into, and the motion of the lane that is clicked."""

HOST = "127.0.0.1"
"""The address of the page: that of this machine, which others do not reach."""
