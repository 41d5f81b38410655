"""Run folders that somebody has edited, and every key of which is right again."""

import json

import pyarrow as pa
import pyarrow.parquet as pq

from nlctl.analysis.robustness.runs import store
from nlctl.analysis.studies.intact import _rows, _tables
from nlctl.analysis.studies.sealed import file_digest, read_json, write_json


def reseal(folder, *names):
    """Put the keys of files, which were edited, into whatever names these."""
    record = read_json(folder / "contents.json")
    for name in names:
        part = folder / name
        finding = part.with_name("finding.json")
        if part.suffix == ".parquet" and finding.exists():
            content = read_json(finding)
            content["tables"][part.stem] = file_digest(part)
            write_json(finding, content)
            record["files"][finding.relative_to(folder).as_posix()] = file_digest(finding)
        record["files"][name] = file_digest(part)
    files = [folder / name for name in record["files"]]
    tables = _tables(folder, files)
    write_json(folder / "contents.json", record | {"rows": _rows(tables), "tables": tables})


def write_chunk(path, frame):
    """Write rows as a chunk, each column with the key that fits."""
    columns = {"row": frame.index.to_numpy()} | {name: frame[name].array for name in frame}
    arrays = {name: pa.array(values, from_pandas=False) for name, values in columns.items()}
    seals = {name: store._seal(frame[name]) for name in frame}
    kept = pa.table(arrays).replace_schema_metadata({store.SEALS: json.dumps(seals)})
    pq.write_table(kept, path)
