"""`r2c2r key`."""

import argparse

from r2c2r_core.commands.options import Parsers, add_command, add_data, web_module


def add(parsers: Parsers) -> None:
    """The command and its options."""
    add_data(add_command(parsers, "key", key))


def key(options: argparse.Namespace) -> int:
    """Print another sign-in address of the running app: each address signs in one browser."""
    print(web_module("serve").new_address(options.data))
    return 0
