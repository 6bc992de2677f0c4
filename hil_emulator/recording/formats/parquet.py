"""Parquet: a column per signal, units and origin in the schema; for pandas and Arrow."""

import importlib
from pathlib import Path

from hil_emulator.recording.format import Format
from hil_emulator.recording.streaming import batches, header_of


def write(source: Path, file: Path) -> None:
    """Write the signals bit for bit."""
    pyarrow = importlib.import_module("pyarrow")
    parquet = importlib.import_module("pyarrow.parquet")
    header = header_of(source)
    fields = [
        pyarrow.field(name, pyarrow.float64(), metadata={"unit": unit})
        for name, unit in header["columns"].items()
    ]
    schema = pyarrow.schema(fields, metadata=header["provenance"])
    with parquet.ParquetWriter(file, schema) as writer:
        for batch in batches(source):
            columns = [pyarrow.array(column) for column in batch.T]
            writer.write_table(pyarrow.Table.from_arrays(columns, schema=schema))


FORMAT = Format((".parquet",), write, needs="pyarrow")
