"""The reference pages by the names of their files."""

from build_time.reference import (
    command_line,
    configuration,
    effects,
    faults,
    index,
    log_formats,
    objects,
    requests,
    result_json,
    scenarios,
)

PAGES = {
    "configuration": configuration,
    "scenarios": scenarios,
    "command_line": command_line,
    "effects": effects,
    "faults": faults,
    "objects": objects,
    "result_json": result_json,
    "log_formats": log_formats,
    "requests": requests,
}


def texts() -> dict[str, str]:
    """Return the text of each page by the name of its file, the index first."""
    written = {f"{name}.md": module.write() for name, module in PAGES.items()}
    schema = {requests.SCHEMA: requests.schema_text()}
    return {"index.md": index.write(PAGES)} | written | schema
