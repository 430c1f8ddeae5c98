"""The logger of the messages that a user sees; it loads no other library."""

import logging

LOGGER = logging.getLogger("fingerpad")
"""Logger of the messages: standard error, unless logging is configured otherwise."""
