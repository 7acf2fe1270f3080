"""The app with stand-ins for its slow parts: `python -m tests.browser.stand_in DATA PORT LIVE [NAME]`.

LIVE is the live segmenter among tests/app/fakes, live or panels; a NAME asks for accounts.
"""

import sys
from dataclasses import replace
from functools import partial
from pathlib import Path

from app import serve
from app.main import create_app
from tests.app.conftest import FAKE_COMMANDS, fake


def main() -> None:
    data, port, live, names = Path(sys.argv[1]), int(sys.argv[2]), sys.argv[3], sys.argv[4:]
    vars(serve)["create_app"] = partial(create_app, commands=replace(FAKE_COMMANDS, live=fake(live)))
    serve.serve(host="127.0.0.1", port=port, data_dir=data, names=names)


if __name__ == "__main__":
    main()
