"""Exception hierarchy.

R2C2RError
├── InputError            what the person gave cannot be used (exit 2)
│   ├── CaptureError          a recording: foreign, truncated, without depth …
│   ├── PromptError           prompts.json, or a click that hits nothing usable
│   ├── OverrideError         overrides.json, an uploaded mesh
│   └── BundleError           a bundle or truth file that cannot be read
├── StageError            the work failed on readable input (exit 1)
│   ├── ObjectNotSeen         no frame shows the object
│   ├── GenerationFailed      no candidate mesh could be made
│   ├── PlacementFailed       no trustworthy pose was found
│   └── ExportFailed          the bundle could not be written
├── BackendUnavailable    an extra, weights or a system library is missing (exit 1)
├── EnvironmentProblem    full disk, taken port, unwritable folder (exit 1)
└── Cancelled             the person asked to stop (exit 1)
"""


class R2C2RError(Exception):
    """One line that names what was found and what was expected; `hint` is the next step."""

    exit_code = 1

    def __init__(self, message: str, *, hint: str = "") -> None:
        super().__init__(message)
        self.message = message
        self.hint = hint

    def __str__(self) -> str:
        return f"{self.message}; {self.hint}" if self.hint else self.message


class InputError(R2C2RError):
    """The user's input cannot be used."""

    exit_code = 2


class CaptureError(InputError):
    """A recording cannot be read."""


class PromptError(InputError):
    """A prompts file or a click cannot be used."""


class OverrideError(InputError):
    """An overrides file or an uploaded mesh cannot be used."""


class BundleError(InputError):
    """A bundle or a truth file cannot be read."""


class StageError(R2C2RError):
    """The work failed on readable input."""


class ObjectNotSeen(StageError):
    """No frame shows the object."""


class GenerationFailed(StageError):
    """No candidate mesh could be made."""


class PlacementFailed(StageError):
    """No trustworthy pose was found."""


class ExportFailed(StageError):
    """The bundle could not be written."""


class BackendUnavailable(R2C2RError):
    """An extra, weights or a system library is missing."""


class EnvironmentProblem(R2C2RError):
    """The machine cannot serve the request: full disk, taken port, unwritable folder."""


class Cancelled(R2C2RError):
    """The user cancelled the work."""
