"""The example of README prints what README shows."""

import contextlib
import io
import re
import unittest

from common import ROOT


class Readme(unittest.TestCase):
    def test_the_example_prints_what_is_shown(self):
        text = (ROOT / "README.md").read_text(encoding="utf-8")
        blocks = re.findall(r"```python\n(.*?)```\n```text\n(.*?)```", text, re.DOTALL)
        # The other block needs a simulator; test_cocotb has its lines.
        self.assertEqual((len(blocks), text.count("```python")), (1, 2))
        for example, shown in blocks:
            printed = io.StringIO()
            with contextlib.redirect_stdout(printed):
                exec(example, {})
            self.assertEqual(printed.getvalue(), shown)


if __name__ == "__main__":
    unittest.main()
