"""`r2c2r serve`."""

import argparse
from pathlib import Path

from r2c2r_core.commands.options import Parsers, add_command, add_data, existing, port, web_module, whole


def add(parsers: Parsers) -> None:
    """The command and its options."""
    added = add_command(parsers, "serve", serve)
    add_address(added)
    add_data(added)
    added.add_argument("--jobs", type=whole(0, 64), default=1, help="heavy jobs at a time; 0: see r2c2r work (default: 1)")
    added.add_argument(
        "--workers", type=whole(0, 64), default=0, help="parallel objects of a job; 0: as many as cores and memory allow"
    )
    added.add_argument("--max-upload", type=whole(1, 1024), default=16, metavar="GB", help="per upload (default: %(default)s)")
    quota = "limit per person; NAME is jobs, uploads, upload_gb, samples or projects"
    added.add_argument("--quota", action="append", default=[], metavar="NAME=N", help=quota)
    added.add_argument("--adopt", action="store_true", help="add projects for folders that are not in the database")
    folder = "another folder, beside the home folder, from which recordings may be imported by path"
    added.add_argument("--import-from", type=Path, action="append", default=[], metavar="DIR", help=folder)
    added.add_argument("--name", action="append", default=[], metavar="HOST", help="another host name of this server")
    trust = "trust X-Forwarded-For and X-Forwarded-Proto (client address, user, TLS) from the proxy at this address or network"
    added.add_argument("--behind-proxy", action="append", default=[], metavar="ADDRESS", help=trust)


def add_address(parser: argparse.ArgumentParser) -> None:
    """Add options for the app's address."""
    parser.add_argument("--host", default="127.0.0.1", help="address to listen on (default: %(default)s)")
    parser.add_argument("--port", type=port, default=8000, help="port to listen on (default: %(default)s)")


def serve(options: argparse.Namespace) -> int:
    """Serve the web app."""
    limits = {"heavy_jobs": options.jobs, "workers": options.workers, "max_upload_bytes": options.max_upload * 2**30}
    limits["quotas"] = web_module("settings").quotas_from(options.quota)
    app = web_module("serve")
    app.serve(
        host=options.host,
        port=options.port,
        data_dir=options.data,
        names=options.name,
        behind_proxy=options.behind_proxy,
        adopt=options.adopt,
        import_from=[existing(folder) for folder in options.import_from],
        **limits,
    )
    return 0
