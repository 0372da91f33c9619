"""The notebooks run from top to bottom without a screen, and draw what they show."""

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


class Notebooks(unittest.TestCase):
    def test_stable(self):
        notebook = json.loads((EXAMPLES / "stable.ipynb").read_text(encoding="utf-8"))
        names, pictures, printed = {}, [], io.StringIO()
        with contextlib.redirect_stdout(printed):
            for cell in notebook["cells"]:
                if cell["cell_type"] == "code":
                    self.assertEqual(cell["outputs"], [], "outputs are not kept")
                    shown = shown_by(cell, names)
                    if shown is not None:
                        pictures += re.findall(r'src="data:image/png;base64,([^"]+)"', shown._repr_html_())
        self.assertEqual(len(pictures), 2, "of the run, and of the map")
        for picture in pictures:
            self.assertEqual(base64.b64decode(picture)[:8], b"\x89PNG\r\n\x1a\n")
        self.assertIn("settled limit_cycle", printed.getvalue())
        counts = [int(count) for count in re.findall(r"(\d+) of 40 settle", printed.getvalue())]
        self.assertEqual(len(counts), 2, printed.getvalue())
        self.assertGreater(counts[0], counts[1], "the hybrid wall is stable where the conventional one is not")


if __name__ == "__main__":
    unittest.main()
