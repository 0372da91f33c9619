"""The notebooks run from top to bottom without a screen, and show what their files have."""

import ast
import base64
import contextlib
import io
import json
import re
import unittest
from pathlib import Path

EXAMPLES = Path(__file__).parents[1] / "examples"


def shown_by(cell, names):
    """Runs a cell as a notebook does, and returns the value of its last line if that is an expression."""
    tree = ast.parse("".join(cell["source"]))
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, "cell", "exec"), names)
    return eval(compile(ast.Expression(last.value), "cell", "eval"), names) if last else None


# What testbench/notebook.py makes smaller or leaves out: pictures, and times of runs.
PICTURE = re.compile(r'(?<=src="data:image/png;base64,)[^"]+')
TIMES = re.compile(r"(edges .* in )\S+ \S+( by \w+): \S+ edges/s")


def of(cell, kind, name):
    """Returns what the file has of a cell's outputs of this kind."""
    outputs = [output for output in cell["outputs"] if output["output_type"] == kind]
    return "".join("".join(output.get("data", output)[name]) for output in outputs)


class Notebooks(unittest.TestCase):
    def test_stable(self):
        notebook = json.loads((EXAMPLES / "stable.ipynb").read_text(encoding="utf-8"))
        names, pictures, all_printed = {}, [], ""
        for cell in notebook["cells"]:
            # The package is there already.
            if cell["cell_type"] != "code" or cell["source"][0].startswith("%"):
                continue
            with contextlib.redirect_stdout(io.StringIO()) as printed:
                shown = shown_by(cell, names)
            self.assertEqual(printed.getvalue(), of(cell, "stream", "text"))
            all_printed += printed.getvalue()
            if shown is not None:
                html = shown._repr_html_()
                pictures += PICTURE.findall(html)
                kept = of(cell, "execute_result", "text/html")
                self.assertEqual(PICTURE.sub("", TIMES.sub(r"\1…\2", html)), PICTURE.sub("", kept))
                self.assertEqual(len(PICTURE.findall(html)), len(PICTURE.findall(kept)))
        self.assertEqual(len(pictures), 2, "of the run, and of the map")
        for picture in pictures:
            self.assertEqual(base64.b64decode(picture)[:8], b"\x89PNG\r\n\x1a\n")
        self.assertIn("settled limit_cycle", all_printed)
        counts = [int(count) for count in re.findall(r"(\d+) of 135 settle", all_printed)]
        self.assertEqual(len(counts), 2, all_printed)
        self.assertGreater(counts[0], counts[1], "the hybrid wall is stable where the conventional one is not")


if __name__ == "__main__":
    unittest.main()
