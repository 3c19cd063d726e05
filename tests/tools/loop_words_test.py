# SPDX-License-Identifier: Apache-2.0
"""loop_words_test.py FOLDER: the pieces of the demo's loop (tools/lib/loop), without a camera."""
import math
import struct
import sys
import tempfile
import unittest

sys.path.insert(0, sys.argv.pop(1))
import frames  # noqa: E402
import pictures  # noqa: E402
import seal  # noqa: E402
import words  # noqa: E402

NAN = float("nan")


def found(name, others=()):
    return {"name": name, "is_rest": False, "or": list(others), "covariates": ["time"], "numbers": []}


class Frames(unittest.TestCase):
    def test_the_root_mean_square_is_of_what_is_a_number(self):
        self.assertAlmostEqual(frames.rms([3.0, NAN, 4.0]), math.sqrt(12.5))
        self.assertTrue(math.isnan(frames.rms([NAN])))

    def test_pixels_beside_a_jump_or_a_hole_are_not_judged(self):
        row = [1.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 2.0, 2.0, NAN]
        self.assertEqual(frames.away_from_edges(10, 1, row), [True] * 3 + [False] * 2 + [True] * 3 + [False] * 2)

    def test_a_slope_is_no_jump(self):
        self.assertEqual(frames.away_from_edges(5, 1, [1.0, 1.02, 1.04, 1.06, 1.08]), [True] * 5)

    def test_a_numpy_file_is_read_as_it_was_written(self):
        header = b"{'descr': '<f4', 'fortran_order': False, 'shape': (1, 2), }"
        with tempfile.NamedTemporaryFile() as file:
            file.write(b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + struct.pack("<2f", 1.5, NAN))
            file.flush()
            width, height, numbers = frames.read_npy(file.name)
        self.assertEqual((width, height, numbers[0]), (2, 1, 1.5))
        self.assertTrue(math.isnan(numbers[1]))


class Pictures(unittest.TestCase):
    def test_too_near_is_blue_too_far_is_red_and_nothing_is_white(self):
        self.assertEqual([pictures.signed(v, 10) for v in (-10, 0, 99)], [pictures.BLUE, pictures.WHITE, pictures.RED])
        self.assertEqual(pictures.signed(NAN, 10), pictures.NOTHING)


class Words(unittest.TestCase):
    def test_a_name_among_several_is_found_and_said_first(self):
        report = {"effects": [found("a", ["b", "warm_up", "c"])]}
        choices = {"warm_up": {"found": "a drift"}}
        line = words.found_list(report, [{"type": "warm_up"}], choices)
        self.assertIn("A drift (<code>warm_up</code>, or 3 other forms", line)
        self.assertIn("right", line)
        self.assertTrue(words.is_found({"type": "warm_up"}, report))
        self.assertFalse(words.is_found({"type": "delay"}, report))

    def test_a_twin_that_got_worse_is_not_praised(self):
        self.assertIn("no better", words.title({"before": 5.0, "after": 6.0, "noise": 1.0}))

    def test_only_an_error_of_the_size_of_noise_is_called_noise(self):
        self.assertIn("noise", words.title({"before": 9.0, "after": 2.05, "noise": 2.0}))
        self.assertIn("75 %", words.title({"before": math.hypot(8, 2), "after": math.hypot(2, 2), "noise": 2.0}))

    def test_what_was_hidden_and_not_found_is_said(self):
        choices = {"delay": {"found": "a delay"}}
        self.assertIn("Not found by its name", words.found_list({"effects": []}, [{"type": "delay"}], choices))

    def test_a_number_has_as_many_digits_as_its_error_allows(self):
        self.assertEqual(words.shown_number({"value": 0.0099476, "error": 0.00034}), "0.00995 ± 0.00034")
        self.assertEqual(words.shown_number({"value": 118.23, "error": 21.0}), "118 ± 21")


class Seal(unittest.TestCase):
    HIDDEN = [{"type": name, "words": "", "found": "", "strength": [1.0, 2.0]} for name in "abc"]

    def test_two_of_the_list_are_hidden_each_within_its_bounds(self):
        for seed in range(20):
            text = seal.sealed("", self.HIDDEN, seed)
            strengths = [float(line.split("=")[1]) for line in text.splitlines() if line.startswith("strength")]
            self.assertEqual(len(strengths), 2)
            self.assertTrue(all(1.0 <= one <= 2.0 for one in strengths), f"seed {seed}: {strengths}")

    def test_the_hash_of_one_seed_cannot_be_looked_up(self):
        self.assertNotEqual(seal.sealed("", self.HIDDEN, 1), seal.sealed("", self.HIDDEN, 1))


if __name__ == "__main__":
    unittest.main()
