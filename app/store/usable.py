"""Check of an object store's settings, with a one-line error before anything waits for the store."""

import logging
import re
from datetime import timedelta

from app.settings import Settings
from app.store.objects import open_objects
from r2c2r_core.errors import InputError

_log = logging.getLogger(__name__)

WRITTEN = "checked"  # an empty object, to test write permission
_CREDENTIALS = {
    "s3": "AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY",
    "gs": "GOOGLE_APPLICATION_CREDENTIALS",
    "az": "AZURE_STORAGE_ACCOUNT_NAME and AZURE_STORAGE_ACCOUNT_KEY",
}
_WRONG = tuple(
    (re.compile(said), why, hint)
    for said, why, hint in (
        # where cloud machines request credentials if none are set
        (r"169\.254\.169\.254|metadata\.google\.internal", "no credentials are set", "set {credentials}"),
        (r"builder error", "its endpoint has no TLS", "set AWS_ENDPOINT_URL to an https address, or AWS_ALLOW_HTTP=true"),
        (r"code: 404", "there is no bucket {bucket}", "make it, or name another one; AWS_ENDPOINT_URL sets the provider"),
        (r"code: 40[13]", "it refuses the credentials ({code})", "check {credentials}, and that they may list, read and write"),
        (r"code: (30\d|400)", "it does not understand the request ({code})", "check AWS_REGION and AWS_ENDPOINT_URL"),
        (r"Permission denied|Read-only", "nothing can be written there", "give its folder to the account that runs r2c2r"),
    )
)


def require_store(settings: Settings) -> None:
    """Raise InputError for settings that can never work; a store that does not answer now may do so later."""
    if not settings.store:
        return
    open_objects(settings.store)
    import obstore

    store = obstore.store.from_url(settings.store, retry_config={"max_retries": 1, "retry_timeout": timedelta(seconds=5)})
    try:
        list(obstore.list(store, WRITTEN))  # first: some servers create a bucket on the first write
        obstore.put(store, WRITTEN, b"")
    except (obstore.exceptions.BaseError, OSError) as error:
        if wrong := refusal(settings.store, str(error)):
            raise wrong from error
        _log.warning("R2C2R_STORE %s does not answer, jobs wait: %s", settings.store, str(error).splitlines()[0])


def refusal(address: str, said: str) -> InputError | None:
    """The error in the settings derived from the store's first response; None where they may be right."""
    found = re.search(r"<Code>(\w+)", said) or re.search(r"code: (\d+)", said)
    scheme, _, place = address.partition("://")
    words = {
        "code": found[1] if found else "",
        "bucket": place.partition("/")[0],
        "credentials": _CREDENTIALS.get(scheme, "its credentials"),
    }
    for pattern, why, hint in _WRONG:
        if pattern.search(said):
            return InputError(f"R2C2R_STORE {address[:80]}: {why.format(**words)}", hint=hint.format(**words))
    return None
