"""`r2c2r token`."""

import argparse
import time

from r2c2r_core.commands.options import Parsers, add_command, add_data, web_module, whole
from r2c2r_core.terminal import table

_ACTIONS = ("add", "list", "revoke")
_SCOPES = "metrics, read, annotator, reviewer or admin"


def add(parsers: Parsers) -> None:
    """The command and what it can do."""
    actions = add_command(parsers, "token", token).add_subparsers(required=True, dest="what", metavar="|".join(_ACTIONS))
    for what in _ACTIONS:
        action = actions.add_parser(what)
        add_data(action)
        if what == "add":
            action.add_argument("name", help="name of the token, such as its purpose")
            action.add_argument("--scope", default="annotator", help=f"permissions: {_SCOPES} (default: %(default)s)")
            action.add_argument("--account", metavar="NAME", help="account it acts for (default: whoever starts the server)")
        if what == "revoke":
            action.add_argument("number", type=whole(0, 2**63 - 1), help="number of the token, as `list` shows it")


def token(options: argparse.Namespace) -> int:
    """Manage the API tokens of programs: add, list, revoke."""
    users, data = web_module("users"), options.data
    if options.what == "add":
        print(users.add_token(data, options.account, options.name, options.scope))
    elif options.what == "list":
        columns = ("number", "name", "scope", "acts for", "last used")
        rows = [(str(t.id), t.name, t.scope, t.owner or "the server's user", _when(t.used)) for t in users.tokens_of(data)]
        print(table(columns, rows))
    elif options.what == "revoke":
        users.revoke_token(data, options.number)
    return 0


def _when(at: float | None) -> str:
    return "never" if at is None else time.strftime("%Y-%m-%d %H:%M", time.localtime(at))
