"""`r2c2r db`."""

import argparse
from pathlib import Path

from r2c2r_core.commands.options import Parsers, add_command, add_data, web_module
from r2c2r_core.terminal import show_progress, table

_PLACE = "a new FILE.db, or postgresql+psycopg://USER@HOST/NAME"


def add(parsers: Parsers) -> None:
    """The command and what it can do."""
    actions = add_command(parsers, "db", db).add_subparsers(required=True, dest="what", metavar="move|backup|restore|check")
    move = actions.add_parser("move")
    move.add_argument("source", metavar="FROM", help="FILE.db, or the address of a PostgreSQL database")
    move.add_argument("target", metavar="TO", help=_PLACE)
    backup = actions.add_parser("backup")
    add_data(backup)
    backup.add_argument("-o", dest="target", type=Path, required=True, metavar="OUT.db", help="new file to write")
    restore = actions.add_parser("restore")
    restore.add_argument("source", type=Path, metavar="BACKUP.db", help="file written by `r2c2r db backup`")
    add_data(restore)
    add_data(actions.add_parser("check"))


def db(options: argparse.Namespace) -> int:
    """Move, back up, restore or check the database, a file or PostgreSQL (R2C2R_DATABASE)."""
    rows = web_module("db.moving")
    with show_progress() as shown:
        progress = shown.for_stage("db")
        if options.what == "move":
            held = rows.move(options.source, options.target, progress=progress)
        elif options.what == "backup":
            rows.backup(options.data, options.target, progress=progress)
            held = []
        elif options.what == "restore":
            held = rows.restore(options.source, options.data, progress=progress)
        else:
            held = rows.check(options.data)
    print(table(("table", "rows", "digest"), [(each.table, str(each.rows), each.digest) for each in held]) if held else "done")
    return 0
