"""Write the reference pages: `python docs/build_time/write_reference.py`."""

import sys
from pathlib import Path

DOCS = Path(__file__).parent.parent

if __name__ == "__main__":
    sys.path.insert(0, str(DOCS))
    from build_time.reference.pages import texts

    for name, text in texts().items():
        (DOCS / "reference" / name).write_text(text, encoding="utf-8")
        print(f"docs/reference/{name}")
