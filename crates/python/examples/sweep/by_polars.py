"""The stiffest wall that settles, by damping, out of a sweep that hpu has gathered; by polars.

    hpu sweep run STUDY -o DIR
    python by_polars.py DIR

Reads `gathered.parquet`; `DIR/shards-1/*.parquet` reads as well before the sweep is complete. The columns' units are in
the file's metadata.
"""

import pathlib
import sys

import polars as pl

file = pathlib.Path(sys.argv[1]) / "gathered.parquet"
unit = pl.read_parquet_metadata(file)["wall.stiffness"]
found = (
    pl.scan_parquet(file)
    .filter(pl.col("state") == "made", pl.col("outcome") == "settled")
    .group_by("wall.damping")
    .agg(pl.col("wall.stiffness").max().alias("stiffest"), pl.len().alias("settled"))
    .sort("wall.damping")
    .collect()
)
for damping, stiffest, settled in found.iter_rows():
    print(f"damping {damping:g}: settles up to {stiffest:g} {unit}, {settled} cells")
