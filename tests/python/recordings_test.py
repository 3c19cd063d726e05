# SPDX-License-Identifier: Apache-2.0
"""Recordings written and read in Python."""
import os
import tempfile
import unittest

import numpy as np
import toftwin

CAMERA = toftwin.CameraInfo(8, 6, 7.0, 7.0, 3.5, 2.5)


def frame(number, source="mine"):
    return toftwin.Frame(source, {"range": np.full((6, 8), number, np.float32)}, CAMERA, sequence=number,
                         received_ns=10**18 + 10**8 * number, world_from_camera=toftwin.pose([number, 0, 0]))


class Recordings(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.file = os.path.join(self.folder.name, "a.mcap")

    def tearDown(self):
        self.folder.cleanup()

    def write(self, frames):
        with toftwin.Writer(self.file) as writer:
            for one in frames:
                writer.write(one)
            self.assertEqual(writer.frames, len(frames))

    def test_what_was_written_is_read(self):
        self.write([frame(i) for i in range(10)])
        recording = toftwin.open(self.file)
        self.assertEqual((len(recording), recording.sources, recording.damage), (10, {"mine": 10}, ""))
        for i, one in enumerate(recording):
            self.assertEqual((one.sequence, one["range"][0, 0], one.camera), (i, i, CAMERA))
            np.testing.assert_allclose(one.world_from_camera, toftwin.pose([i, 0, 0]))
        self.assertEqual(i, 9)

    def test_it_can_be_read_twice(self):
        self.write([frame(i) for i in range(3)])
        recording = toftwin.open(self.file)
        self.assertEqual(len(list(recording)), 3)
        self.assertEqual(len(list(recording)), 3)

    def test_one_source_of_several_can_be_read_alone(self):
        self.write([frame(0, "a"), frame(1, "b"), frame(2, "a")])
        self.assertEqual([one.sequence for one in toftwin.open(self.file, source="a")], [0, 2])
        with self.assertRaisesRegex(toftwin.Error, "no source c; it has a, b"):
            toftwin.open(self.file, source="c")

    def test_seeking_goes_to_a_time(self):
        self.write([frame(i) for i in range(10)])
        recording = toftwin.open(self.file)
        recording.seek(10**18 + 10**8 * 7)
        self.assertEqual(next(recording).sequence, 7)

    def test_a_file_that_is_there_is_not_overwritten_unless_asked(self):
        self.write([frame(0)])
        with self.assertRaises(toftwin.Error) as raised:
            toftwin.Writer(self.file)
        self.assertEqual(raised.exception.code, "invalid_argument")
        toftwin.Writer(self.file, overwrite=True).close()

    def test_what_is_no_recording_is_an_error(self):
        with open(self.file, "w", encoding="utf-8") as file:
            file.write("no recording")
        with self.assertRaises(toftwin.Error) as raised:
            toftwin.open(self.file)
        self.assertEqual(raised.exception.code, "malformed")


unittest.main()
