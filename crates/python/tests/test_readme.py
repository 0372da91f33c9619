"""The examples of the READMEs and of the book print what is shown below them."""

import contextlib
import io
import re
import unittest

from common import ROOT


class Readme(unittest.TestCase):
    def test_the_examples_print_what_is_shown(self):
        # Of the book's page, the other block needs a simulator; test_cocotb has its lines.
        pages = {"README.md": 1, "crates/python/README.md": 1, "crates/book/pages/python.md": 2}
        for page, all_blocks in pages.items():
            text = (ROOT / page).read_text(encoding="utf-8")
            blocks = re.findall(r"```python\n(.*?)```\n```text\n(.*?)```", text, re.DOTALL)
            self.assertEqual((len(blocks), text.count("```python")), (1, all_blocks), page)
            for example, shown in blocks:
                printed = io.StringIO()
                with contextlib.redirect_stdout(printed):
                    exec(example, {})
                self.assertEqual(printed.getvalue(), shown, page)


if __name__ == "__main__":
    unittest.main()
