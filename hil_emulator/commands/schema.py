"""`hil-emulator schema`: the JSON Schema for editors of TOML."""

import json
from pathlib import Path

import click

from hil_emulator.config.json_schema import json_schema
from hil_emulator.platform.output_files import write_texts


def schema(what: str, out: Path | None, *, overwrite: bool = False) -> None:
    """Write the JSON Schema of a kind of file, or print it.

    Raises:
        UserError: if the file exists or cannot be written.

    """
    text = json.dumps(json_schema(what), indent=1, ensure_ascii=False)
    if out is None:
        click.echo(text)
        return
    write_texts({out: text + "\n"}, overwrite=overwrite)
    click.echo(f'written to {out}; a file in the same folder begins with "#:schema ./{out.name}"')
