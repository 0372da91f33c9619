"""Runs a notebook in the environment of this Python, and holds its outputs against those that the file has.

Usage: notebook.py [--update] NOTEBOOK: with --update, writes the outputs.
Pictures are kept at half of their pixels, so that the file stays small. Times of runs are left out, and so is what
`%pip` says.
"""

import base64
import io
import re
import sys

import nbformat
from nbclient import NotebookClient
from PIL import Image

PICTURE = re.compile(r'(src="data:image/png;base64,)([^"]+)"')
TIMES = re.compile(r"(edges .* in )\S+ \S+( by \w+): \S+ edges/s")


def reduced(picture):
    """Returns a picture in base64 at half of its pixels, in 128 colours."""
    image = Image.open(io.BytesIO(base64.b64decode(picture))).convert("RGB")
    small = image.resize((image.width // 2, image.height // 2), Image.Resampling.LANCZOS).quantize(128)
    out = io.BytesIO()
    small.save(out, "png", optimize=True)
    return base64.b64encode(out.getvalue()).decode("ascii")


def kept(notebook):
    """Keeps of the outputs what is the same at each run."""
    for cell in notebook.cells:
        if cell.cell_type == "code" and cell.source.startswith("%"):
            cell.outputs = []
        for output in cell.get("outputs", []):
            data = output.get("data", {})
            # The HTML has the picture.
            if "text/html" in data:
                data.pop("image/png", None)
                html = TIMES.sub(r"\1…\2", data["text/html"])
                data["text/html"] = PICTURE.sub(lambda found: f'{found[1]}{reduced(found[2])}"', html)
    notebook.metadata = {"kernelspec": notebook.metadata.kernelspec, "language_info": {"name": "python"}}


def seen(notebook):
    """Returns what a reader sees of the outputs of each cell, with pictures as pixels."""

    def pixels(found):
        return Image.open(io.BytesIO(base64.b64decode(found[2]))).convert("RGB").tobytes().hex()

    cells = []
    for cell in notebook.cells:
        outputs = [dict(output.get("data") or {"text": output.get("text")}) for output in cell.get("outputs", [])]
        for data in outputs:
            if "text/html" in data:
                data["text/html"] = PICTURE.sub(pixels, data["text/html"])
        cells.append(outputs)
    return cells


def main():
    path = sys.argv[-1]
    committed = nbformat.read(path, as_version=4)
    notebook = nbformat.from_dict(committed)
    NotebookClient(notebook, timeout=600, kernel_name="python3", record_timing=False,
                   extra_arguments=["--log-level=ERROR"]).execute()
    kept(notebook)
    if sys.argv[1] == "--update":
        nbformat.write(notebook, path)
    for cell, now, then in zip(notebook.cells, seen(notebook), seen(nbformat.read(path, as_version=4)), strict=True):
        if now != then:
            sys.exit(f"error: {path}: other outputs than those in the file, of the cell\n{cell.source}")
    print(f"{path}: {len(notebook.cells)} cells run, with the outputs that the file has")


if __name__ == "__main__":
    main()
