"""Reader of the CSV files that Tandem writes."""

import csv
import pathlib
from typing import Dict

import numpy as np


def read_table(path: pathlib.Path) -> Dict[str, np.ndarray]:
    """Returns the columns of a CSV file by name: float64, or text if an entry is not a number. Empty ones are NaN."""
    text = path.read_text(encoding="utf-8")
    header, _, body = text.partition("\n")
    names = header.strip().split(",")
    body = body.strip()
    if not body:
        return {name: np.empty(0) for name in names}
    rows = body.count("\n") + 1
    if '"' not in body:
        flat = body.replace("\n", ",").split(",")
        if len(flat) == rows * len(names):
            try:
                cells = np.array([x or "nan" for x in flat], dtype=object).astype(float)
                return dict(zip(names, cells.reshape(rows, len(names)).T))
            except ValueError:
                pass
    columns = list(zip(*csv.reader(body.splitlines())))
    result = {}
    for name, column in zip(names, columns):
        try:
            result[name] = np.array([float(x or "nan") for x in column])
        except ValueError:
            result[name] = np.array(column)
    return result
