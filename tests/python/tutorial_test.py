# SPDX-License-Identifier: Apache-2.0
"""What docs/python.md shows runs, block after block, as in a notebook."""
import contextlib
import io
import os
import re
import tempfile
import unittest

from running_daemon import Daemon

PAGE = os.path.join(os.environ["TOFTWIN_SOURCE"], "docs", "python.md")
CONFIGURATION = """
recording_folder = "recordings"

[[source]]
name = "twin"
driver = "sim"
uri = "sim:o3d303"
samples_per_pixel = 1
"""


class Tutorial(unittest.TestCase):
    def test_every_block_runs_and_prints_what_the_page_says(self):
        with open(PAGE, encoding="utf-8") as file:
            blocks = re.findall(r"^```python\n(.*?)^```\n(?:\n?```text\n(.*?)^```\n)?", file.read(), re.MULTILINE | re.DOTALL)
        self.assertGreater(len(blocks), 5)
        names = {}
        with Daemon(CONFIGURATION) as daemon, tempfile.TemporaryDirectory() as folder:
            os.environ["TOFTWIN_ADDRESS"] = daemon.address
            os.chdir(folder)
            for code, said in blocks:
                printed = io.StringIO()
                with contextlib.redirect_stdout(printed):
                    exec(compile(code, PAGE, "exec"), names)  # pylint: disable=exec-used
                if said:
                    self.assertEqual(printed.getvalue().strip(), said.strip(), code)
            os.chdir("/")
            names["client"].close()


unittest.main()
