# SPDX-License-Identifier: Apache-2.0
"""Discovery and correction of tables in Python."""
import os
import tempfile
import unittest

import numpy as np
import toftwin

DRAW = np.random.default_rng(3)
REFERENCE = DRAW.uniform(500, 4000, 200)
ERROR = 40 + 0.02 * REFERENCE
TABLE = {"reference_mm": REFERENCE, "measured_mm": REFERENCE + ERROR + DRAW.normal(0, 1.0, 200), "temperature_c": DRAW.uniform(20, 30, 200)}


class Tables(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.found = toftwin.discover(TABLE, draws=50)

    def test_an_offset_and_a_gain_are_found(self):
        self.assertTrue(self.found["headline"])
        self.assertIn("[[effect]]", self.found["model"])
        self.assertIsInstance(self.found["report"], dict)

    def test_they_are_taken_off_again(self):
        done = toftwin.correct(TABLE, self.found["model"])
        self.assertEqual((done["corrected"].shape, done["unit"]), ((200,), "mm"))
        left = done["corrected"] - REFERENCE
        self.assertLess(np.sqrt(np.mean(left**2)), 1.5, "of noise of 1 mm")
        self.assertIn("corrected_mm", done["csv"].splitlines()[0])

    def test_files_do_as_well(self):
        with tempfile.TemporaryDirectory() as folder:
            table, model = os.path.join(folder, "t.csv"), os.path.join(folder, "model.toml")
            np.savetxt(table, np.column_stack(list(TABLE.values())), delimiter=",", header=",".join(TABLE), comments="")
            with open(model, "w", encoding="utf-8") as file:
                file.write(self.found["model"])
            done = toftwin.correct(table, model)
        self.assertLess(np.sqrt(np.mean((done["corrected"] - REFERENCE) ** 2)), 1.5)

    def test_columns_of_unequal_length_are_refused(self):
        with self.assertRaisesRegex(ValueError, "one length"):
            toftwin.discover({"measured_mm": [1, 2], "reference_mm": [1]})

    def test_a_table_that_says_nothing_is_an_error(self):
        with self.assertRaises(toftwin.Error):
            toftwin.discover({"measured_mm": [1.0, 2.0], "reference_mm": [1.0, 2.0]})


unittest.main()
