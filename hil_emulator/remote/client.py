"""Client of the remote control: one request, one answer."""

import json
import urllib.error
import urllib.request
from typing import Any

from hil_emulator.errors import UserError

_ANSWER_S = 10.0  # longer than the server waits for the loop


def request(port: int, method: str, path: str, body: dict[str, Any] | None = None) -> Any:
    """Return the answer of an emulator that runs with `--control`.

    Raises:
        UserError: if no emulator answers at that port, or with the reason of a refusal.

    """
    call = urllib.request.Request(
        f"http://127.0.0.1:{port}{path}",
        method=method,
        data=None if body is None else json.dumps(body).encode(),
        headers={"Content-Type": "application/json"},
    )
    direct = urllib.request.build_opener(urllib.request.ProxyHandler({}))
    try:
        with direct.open(call, timeout=_ANSWER_S) as answer:
            return json.load(answer)
    except urllib.error.HTTPError as error:
        raise UserError(str(json.load(error)["error"])) from None
    except (OSError, ValueError) as error:
        raise UserError(
            f"no emulator answers at port {port}: {error}; start one with run --control {port}"
        ) from None
