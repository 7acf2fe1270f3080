"""The app with stand-ins for its slow parts: `python -m tests.browser.stand_in DATA PORT [NAME]`; a NAME asks for accounts."""

import sys
from functools import partial
from pathlib import Path

from app import serve
from app.main import create_app
from tests.app.conftest import FAKE_COMMANDS


def main() -> None:
    vars(serve)["create_app"] = partial(create_app, commands=FAKE_COMMANDS)
    data, port, names = Path(sys.argv[1]), int(sys.argv[2]), sys.argv[3:]
    serve.serve(host="127.0.0.1", port=port, data_dir=data, names=names)


if __name__ == "__main__":
    main()
