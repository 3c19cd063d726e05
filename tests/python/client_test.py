# SPDX-License-Identifier: Apache-2.0
"""The client in Python with a real daemon."""
import gc
import unittest

import numpy as np
import toftwin
from running_daemon import Daemon


class WithDaemon(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon()

    @classmethod
    def tearDownClass(cls):
        cls.daemon.close()

    def setUp(self):
        self.client = toftwin.connect(self.daemon.address)

    def tearDown(self):
        self.client.close()

    def test_sources_are_listed(self):
        self.assertEqual([one["name"] for one in self.client.sources()], ["paced", "pattern", "short", "twin"])

    def test_a_source_is_described(self):
        about = self.client.describe("twin")
        self.assertTrue(about["can_set_pose"] and about["can_lockstep"])
        self.assertEqual((about["driver"], about["camera"].width), ("sim", about["camera"].rays().shape[1]))
        self.assertIn("range", about["planes"])

    def test_a_source_that_is_not_there_is_an_error_with_a_code(self):
        with self.assertRaises(toftwin.Error) as raised:
            self.client.describe("nobody")
        self.assertEqual(raised.exception.code, "not_found")

    def test_frames_are_iterated_over(self):
        sequences = []
        with self.client.stream("pattern", planes=["range"], policy="lossless") as frames:
            for frame in frames:
                sequences.append(frame.sequence)
                if len(sequences) == 5:
                    break
        self.assertEqual(sequences, list(range(sequences[0], sequences[0] + 5)))

    def test_a_frame_has_the_numbers_of_the_pattern(self):
        with self.client.stream("pattern") as frames:
            frame = frames.next()
        self.assertEqual(frame["range"].shape, (48, 64))
        self.assertEqual(frame.planes, ["range", "depth", "amplitude", "ambient", "flags"])
        is_valid = ~np.isnan(frame["range"])
        self.assertTrue(np.all(np.modf(64 * frame["range"][is_valid])[0] == 0), "ranges of the pattern are 64ths of a metre")
        self.assertTrue(np.array_equal(is_valid, frame["flags"] & 1 == 0))

    def test_a_stream_ends_where_its_source_ends(self):
        self.assertEqual(len([frame.sequence for frame in self.client.stream("short", policy="lossless")]), 3)

    def test_a_region_is_cut_out(self):
        with self.client.stream("pattern", region=(8, 4, 16, 12), planes=["range"]) as frames:
            self.assertEqual(frames.next()["range"].shape, (12, 16))

    def test_frames_outlive_stream_and_client(self):
        client = toftwin.connect(self.daemon.address)
        stream = client.stream("pattern", planes=["amplitude"])
        array = stream.next()["amplitude"]
        stream.close()
        client.close()
        del stream, client
        gc.collect()
        self.assertTrue(np.all(array >= 0))

    def test_a_client_that_was_closed_says_so(self):
        client = toftwin.connect(self.daemon.address)
        stream = client.stream("pattern")
        client.close()
        stream.close()
        with self.assertRaisesRegex(toftwin.Error, "client was closed"):
            client.sources()
        with self.assertRaisesRegex(toftwin.Error, "stream of pattern was closed"):
            stream.next()

    def test_no_daemon_is_an_error(self):
        with self.assertRaises(toftwin.Error) as raised:
            toftwin.connect("unix:/nowhere/s")
        self.assertIn(raised.exception.code, ("disconnected", "not_found"))

    def test_no_frame_in_time_is_a_timeout(self):
        with Daemon('[[source]]\nname = "still"\ndriver = "pattern"\npace = "trigger"\n') as other:
            with toftwin.connect(other.address) as client, client.stream("still") as frames:
                with self.assertRaises(toftwin.Error) as raised:
                    frames.next(timeout=0.05)
                self.assertEqual(raised.exception.code, "timeout")
                client.trigger("still")
                self.assertEqual(frames.next(timeout=60).source, "still")

    def test_under_lockstep_each_frame_has_the_pose_that_was_set_for_it(self):
        with toftwin.connect(self.daemon.address) as client:
            poses = [toftwin.pose([0.1 * i, 0, 0]) for i in range(4)]
            client.set_pose("twin", poses[0])
            with client.stream("twin", policy="lockstep", planes=["range"]) as frames:
                seen = []
                for pose in poses:
                    client.set_pose("twin", pose)
                    seen.append(frames.next(timeout=60).world_from_camera)
            np.testing.assert_allclose(seen[1:], poses[1:], atol=1e-12)

    def test_parameters_are_set_and_told(self):
        self.client.set_parameter("pattern", "speed_px", 3)
        self.assertEqual(self.client.describe("pattern")["parameters"]["speed_px"]["value"], 3)
        with self.assertRaises(toftwin.Error) as raised:
            self.client.set_parameter("pattern", "speed_px", 1e9)
        self.assertEqual(raised.exception.code, "invalid_argument")

    def test_the_daemon_records(self):
        with self.client.stream("paced") as frames:
            path = self.client.start_recording("paced", "mine")
            for _ in range(3):
                frames.next()
            self.client.stop_recording("paced")
        self.assertGreater(len(toftwin.open(path)), 0)

    def test_health_tells_who_is_there(self):
        with self.client.stream("pattern") as frames:
            frames.next()
            health = self.client.health()
        self.assertEqual([one["name"] for one in health["sources"]], ["paced", "pattern", "short", "twin"])
        self.assertGreaterEqual(health["sessions"], 1)

    def test_words_that_mean_nothing_are_value_errors(self):
        with self.assertRaisesRegex(ValueError, "policy: latest, queue"):
            self.client.stream("pattern", policy="all")
        with self.assertRaisesRegex(ValueError, "no plane"):
            self.client.stream("pattern", planes=["infrared"])
        with self.assertRaisesRegex(ValueError, "timeout"):
            self.client.stream("pattern", timeout=-1)


unittest.main()
