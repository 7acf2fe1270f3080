"""`r2c2r serve`."""

import argparse

from r2c2r_core.commands.options import Parsers, add_command, add_data, positive, web_module


def add(parsers: Parsers) -> None:
    """The command and its options."""
    added = add_command(parsers, "serve", serve)
    add_address(added)
    add_data(added)
    added.add_argument("--jobs", type=positive, default=1, help="heavy jobs at a time (default: %(default)s)")
    added.add_argument("--max-upload", type=positive, default=16, metavar="GB", help="default: %(default)s")
    added.add_argument("--name", action="append", default=[], metavar="HOST", help="another name people reach it by")


def add_address(parser: argparse.ArgumentParser) -> None:
    """Where the app listens."""
    parser.add_argument("--host", default="127.0.0.1")
    parser.add_argument("--port", type=int, default=8000)


def serve(options: argparse.Namespace) -> int:
    """The web app."""
    limits = {"heavy_jobs": options.jobs, "max_upload_bytes": options.max_upload * 2**30}
    app = web_module("serve")
    app.serve(host=options.host, port=options.port, data_dir=options.data, names=options.name, **limits)
    return 0
