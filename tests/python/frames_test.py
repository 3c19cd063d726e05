# SPDX-License-Identifier: Apache-2.0
"""Frames of arrays and arrays of frames."""
import gc
import unittest

import numpy as np
import toftwin

CAMERA = toftwin.CameraInfo(4, 3, 2.0, 2.0, 1.5, 1.0)


def frame(**planes):
    return toftwin.Frame("mine", planes or {"range": np.arange(12, dtype=np.float32).reshape(3, 4)}, CAMERA)


class Frames(unittest.TestCase):
    def test_a_plane_has_rows_then_columns(self):
        self.assertEqual(frame()["range"].shape, (3, 4))
        self.assertEqual(frame()["range"][2, 3], 11)

    def test_planes_keep_their_types(self):
        made = frame(flags=np.full((3, 4), 7, np.uint8), amplitude=np.ones((3, 4), np.uint16), color=np.zeros((3, 3, 4), np.uint8),
                     range=np.ones((3, 4), np.float64))
        self.assertEqual([made[p].dtype for p in ("flags", "amplitude", "color", "range")], [np.uint8, np.uint16, np.uint8, np.float32])
        self.assertEqual(made["color"].shape, (3, 3, 4))

    def test_arrays_look_into_the_frame_and_cannot_change_it(self):
        made = frame()
        first, second = made["range"], made["range"]
        self.assertTrue(np.shares_memory(first, second))
        self.assertFalse(first.flags.writeable)
        with self.assertRaises(ValueError):
            first[0, 0] = 1

    def test_an_array_outlives_its_frame(self):
        array = frame()["range"]
        gc.collect()
        self.assertEqual(array.sum(), 66)

    def test_a_plane_that_is_missing_is_named_with_those_there_are(self):
        with self.assertRaisesRegex(KeyError, "depth: the frame has range"):
            frame()["depth"]

    def test_a_plane_that_nobody_knows_is_refused_with_the_words_there_are(self):
        with self.assertRaisesRegex(ValueError, 'no plane "distance".*range, depth'):
            frame(distance=np.zeros((3, 4)))

    def test_a_plane_of_another_size_than_the_camera_is_refused(self):
        with self.assertRaisesRegex(ValueError, "3 x 4 pixels, but the camera has 4 x 3"):
            frame(range=np.zeros((4, 3)))

    def test_a_dictionary_can_be_made_of_it(self):
        self.assertEqual(list(dict(frame())), ["range"])

    def test_points_lie_along_the_rays_at_their_range(self):
        made = frame(range=np.full((3, 4), 2.0))
        points = made.points()
        np.testing.assert_allclose(np.linalg.norm(points, axis=-1), 2.0, rtol=1e-6)
        np.testing.assert_allclose(points[1, 3] / points[1, 3, 2], [(3 - 1.5) / 2, 0, 1], rtol=1e-6)

    def test_points_of_a_depth_have_that_depth(self):
        np.testing.assert_allclose(frame(depth=np.full((3, 4), 2.0)).points()[..., 2], 2.0, rtol=1e-6)

    def test_points_in_the_world_are_moved_by_the_pose(self):
        pose = toftwin.pose([1, 2, 3])
        made = toftwin.Frame("mine", {"range": np.ones((3, 4))}, CAMERA, world_from_camera=pose)
        np.testing.assert_allclose(made.points(world=True), made.points() + np.float32([1, 2, 3]), rtol=1e-6)
        with self.assertRaises(toftwin.Error) as raised:
            frame().points(world=True)
        self.assertEqual(raised.exception.code, "not_found")


class Poses(unittest.TestCase):
    def back(self, pose):
        return toftwin.Frame("mine", {"range": np.ones((3, 4))}, CAMERA, world_from_camera=pose).world_from_camera

    def test_every_rotation_comes_back(self):
        draw = np.random.default_rng(1)
        turns = [draw.normal(size=4) for _ in range(200)] + list(np.eye(4)) + [[1e-9, 1, 0, 0], [0, 1, 1, 0], [0, 1, 1, 1]]
        for turn in turns:
            pose = toftwin.pose(draw.normal(size=3), turn)
            np.testing.assert_allclose(self.back(pose), pose, atol=1e-12)

    def test_what_is_no_rigid_motion_is_refused(self):
        mirrored, scaled, sheared, unknown = np.diag([-1.0, 1, 1, 1]), np.diag([2.0, 2, 2, 1]), np.eye(4), np.eye(4)
        sheared[3, 0], unknown[0, 3] = 1, np.nan
        for matrix in (mirrored, scaled, sheared, unknown, np.eye(3), np.zeros((4, 4))):
            with self.assertRaises(ValueError):
                self.back(matrix)

    def test_a_camera_that_looks_somewhere_has_it_on_its_axis(self):
        pose = toftwin.look_at([1, -2, 0.5], [0, 0, 3])
        in_camera = np.linalg.inv(pose) @ [0, 0, 3, 1]
        np.testing.assert_allclose(in_camera[:2], 0, atol=1e-12)
        self.assertGreater(in_camera[2], 0)
        self.assertLess((pose[:3, :3].T @ [0, -1, 0])[1], 0, "up in the world is up in the image, whose y goes down")
        self.back(pose)

    def test_looking_straight_up_leaves_the_roll_open(self):
        with self.assertRaises(ValueError):
            toftwin.look_at([0, 0, 0], [0, -1, 0])


unittest.main()
