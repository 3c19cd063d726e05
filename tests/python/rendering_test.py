# SPDX-License-Identifier: Apache-2.0
"""The simulator in Python, without a daemon."""
import os
import tempfile
import unittest
import warnings

import numpy as np
import toftwin

WALL = """
[[material]]
name = "grey"
albedo = 0.5
[[object]]
name = "wall"
shape = "rectangle"
size_m = [40, 40, 0]
position_m = [0, 0, 2]
material = "grey"
"""
QUICK = {"samples": 1, "max_surfaces": 1, "pixel_extent": 0.0}


class Rendering(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.scene = os.path.join(self.folder.name, "wall.toml")
        with open(self.scene, "w", encoding="utf-8") as file:
            file.write(WALL)

    def tearDown(self):
        self.folder.cleanup()

    def test_there_is_an_array_for_each_plane_with_one_image_a_pose(self):
        poses = [toftwin.pose([0, 0, z]) for z in (0.0, 0.25, 0.5)]
        made = toftwin.render("o3d303", self.scene, poses, planes=["range", "truth_normal"], **QUICK)
        camera = toftwin.Renderer("o3d303", self.scene, **QUICK).camera
        self.assertEqual(sorted(made), ["range", "truth_normal"])
        self.assertEqual(made["range"].shape, (3, camera.height, camera.width))
        self.assertEqual(made["truth_normal"].shape, (3, 3, camera.height, camera.width))

    def test_true_ranges_are_where_the_rays_meet_the_wall(self):
        camera = toftwin.Renderer("o3d303", self.scene, **QUICK).camera
        for z in (0.0, 1.0):
            made = toftwin.render("o3d303", self.scene, toftwin.pose([0, 0, z]), planes=["truth_range"], **QUICK)
            np.testing.assert_allclose(made["truth_range"][0], (2 - z) / camera.rays()[..., 2], rtol=1e-5)

    def test_the_same_seed_gives_the_same_bytes_and_another_does_not(self):
        first, second, other = (toftwin.render("o3d303", self.scene, planes=["range"], seed=seed, **QUICK)["range"] for seed in (1, 1, 2))
        self.assertEqual(first.tobytes(), second.tobytes())
        self.assertNotEqual(first.tobytes(), other.tobytes())

    def test_frames_say_what_made_them(self):
        frame = next(iter(toftwin.Renderer("o3d303", self.scene, planes=["range"], seed=7, **QUICK)))
        self.assertEqual((frame.provenance["kind"], frame.provenance["seed"]), ("simulated", 7))
        self.assertIn("shot_noise", frame.provenance["effects"])

    def test_a_camera_that_moves_is_there_at_its_times(self):
        poses = [toftwin.pose([0, 0, 0]), toftwin.pose([0, 0, 1])]
        renderer = toftwin.Renderer("o3d303", self.scene, poses, times_s=[0.0, 1.0], frame_interval_s=0.25, frames=3,
                                    planes=["range"], **QUICK)
        self.assertEqual(len(renderer), 3)
        for number, frame in enumerate(renderer):
            self.assertAlmostEqual(frame.world_from_camera[2, 3], 0.25 * number, delta=0.1)

    def test_what_is_odd_is_a_warning(self):
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            toftwin.Renderer("o3d303", self.scene, toftwin.pose([0, 0, 10]), **QUICK)
        self.assertIn("wall.toml", str(said[0].message))

    def test_a_camera_that_nobody_knows_is_an_error(self):
        with self.assertRaises(toftwin.Error) as raised:
            toftwin.render("nobody")
        self.assertIn("kinect_v2", str(raised.exception))
        self.assertIn("o3d303", toftwin.cameras())


unittest.main()
