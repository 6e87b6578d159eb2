"""Settings of all tests."""

from hypothesis import settings

# The same examples on every run: a failure is a failure of the change that was made.
settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.load_profile("repeatable")
