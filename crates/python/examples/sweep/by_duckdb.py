"""The stiffest wall that settles, by damping, out of a sweep that hpu has gathered; by DuckDB.

    hpu sweep run STUDY -o DIR
    python by_duckdb.py DIR

Prints what by_polars.py prints. DuckDB's own command takes the same query.
"""

import pathlib
import sys

import duckdb

file = str(pathlib.Path(sys.argv[1]) / "gathered.parquet")
(unit,) = duckdb.execute(
    "SELECT decode(value) FROM parquet_kv_metadata(?) WHERE decode(key) = 'wall.stiffness'", [file]
).fetchone()
found = duckdb.execute(
    """
    SELECT "wall.damping", max("wall.stiffness"), count(*)
    FROM read_parquet(?)
    WHERE state = 'made' AND outcome = 'settled'
    GROUP BY "wall.damping"
    ORDER BY "wall.damping"
    """,
    [file],
).fetchall()
for damping, stiffest, settled in found:
    print(f"damping {damping:g}: settles up to {stiffest:g} {unit}, {settled} cells")
