"""Results of evaluations, made up."""

from pathlib import Path

from spikeport.experiments.evaluate.table import TableRow, as_json
from spikeport.files import write_json


def write_evaluation(path: Path, *rows: TableRow, **settings: object) -> Path:
    """Write the result of an evaluation of the walk, and return its file."""
    content = {"experiment": "evaluate walk", "backend": "native", "seconds": 20.0}
    write_json(path, {**content, "settings": settings, "rows": as_json(rows)})
    return path
