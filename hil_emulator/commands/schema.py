"""`hil-emulator schema`: what editors of TOML complete and check by."""

import json
from pathlib import Path

import click

from hil_emulator.config.json_schema import json_schema
from hil_emulator.errors import UserError


def schema(what: str, out: Path | None) -> None:
    """Write the JSON Schema of a kind of file, or print it.

    Raises:
        UserError: if the file cannot be written.

    """
    text = json.dumps(json_schema(what), indent=1, ensure_ascii=False)
    if out is None:
        click.echo(text)
        return
    try:
        out.write_text(text + "\n", encoding="utf-8")
    except OSError as error:
        raise UserError(f"{out}: cannot be written: {error}; choose another file") from None
    click.echo(f'written to {out}; a file beside it begins with "#:schema ./{out.name}"')
