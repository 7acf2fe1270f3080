"""`r2c2r user`."""

import argparse
import getpass
import sys

from r2c2r_core.commands.options import Parsers, add_command, add_data, web_module
from r2c2r_core.errors import InputError
from r2c2r_core.terminal import table

_ACTIONS = ("add", "list", "role", "password", "remove")
_ROLES = "annotator, reviewer or admin"


def add(parsers: Parsers) -> None:
    """The command and what it can do."""
    actions = add_command(parsers, "user", user).add_subparsers(required=True, dest="what", metavar="|".join(_ACTIONS))
    for what in _ACTIONS:
        action = actions.add_parser(what)
        add_data(action)
        if what != "list":
            action.add_argument("name", help="name of the account")
        if what == "add":
            action.add_argument("--role", default="annotator", help=f"{_ROLES} (default: %(default)s)")
        if what == "role":
            action.add_argument("role", help=_ROLES)


def user(options: argparse.Namespace) -> int:
    """Manage the accounts of people who may sign in: add, list, role, password, remove."""
    users, data = web_module("users"), options.data
    if options.what == "list":
        print(table(("name", "role"), users.everyone(data)))
    elif options.what == "add":
        users.add(data, options.name, options.role, _password())
    elif options.what == "role":
        users.set_role(data, options.name, options.role)
    elif options.what == "password":
        users.set_password(data, options.name, _password())
    elif options.what == "remove":
        users.remove(data, options.name)
    return 0


def _password() -> str:
    """A password, prompted for twice on a terminal, else the first line of standard input."""
    if not sys.stdin.isatty():
        return sys.stdin.readline().rstrip("\n")
    password = getpass.getpass("password: ")
    if getpass.getpass("password again: ") != password:
        raise InputError("the two passwords differ", hint="try again")
    return password
