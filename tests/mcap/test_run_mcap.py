#!/usr/bin/env python3
"""What `viwo run --mcap` writes, decoded by @mcap/core and @foxglove/rosmsg2-serialization.

    test_run_mcap.py VIWO SOURCE_DIR       exit code 77: skipped, without node or these packages
"""
import json
import math
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

SKIPPED = 77
HERE = pathlib.Path(__file__).resolve().parent
TYPES = {"/viwo/odometry": "nav_msgs/msg/Odometry", "/viwo/path": "nav_msgs/msg/Path",
         "/tf": "tf2_msgs/msg/TFMessage", "/viwo/calibration": "sensor_msgs/msg/JointState",
         "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
         "/viwo/cam0/tracks": "foxglove_msgs/msg/ImageAnnotations",
         "/viwo/cam1/tracks": "foxglove_msgs/msg/ImageAnnotations"}


def seconds(stamp):
    return stamp.get("sec", 0) + 1e-9 * stamp.get("nanosec", stamp.get("nsec", 0))


class RunMcap(unittest.TestCase):
    viwo = source = None

    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        folder = pathlib.Path(cls.temporary.name)
        subprocess.run([cls.viwo, "run", f"{cls.source}/configs/runs/viwo_swerve.yaml", "--set",
                        "sensors.simulator0.duration_s=6", "--out", folder / "out", "--mcap",
                        folder / "deep/run.mcap"], check=True, capture_output=True)
        text = subprocess.run(["node", HERE / "read_mcap.mjs", folder / "deep/run.mcap"], check=True,
                              capture_output=True, text=True).stdout
        cls.read = json.loads(text)
        cls.topics = cls.read["topics"]
        cls.summary = json.loads((folder / "out/summary.json").read_text())
        cls.tum = [[float(x) for x in line.split()]
                   for line in (folder / "out/trajectory.tum").read_text().splitlines()
                   if not line.startswith("#")]
        cls.rows = [line.split(",") for line in
                    (folder / "out/calibration.csv").read_text().splitlines()[1:]]

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def test_types_and_counts(self):
        self.assertEqual({name: one["type"] for name, one in self.topics.items()}, TYPES)
        for one in self.topics.values():
            self.assertEqual((one["encoding"], one["message_encoding"]), ("ros2msg", "cdr"))
        epochs = self.summary["epochs"]
        for name in ["/viwo/odometry", "/tf", "/viwo/calibration"]:
            self.assertEqual(self.topics[name]["count"], epochs)
        self.assertTrue(self.read["in_order"])

    def test_first_and_last_pose(self):
        for which, row in [("first", self.tum[0]), ("last", self.tum[-1])]:
            odometry = self.topics["/viwo/odometry"][which]
            pose = odometry["pose"]["pose"]
            self.assertAlmostEqual(seconds(odometry["header"]["stamp"]), row[0], places=6)
            for value, axis in zip(row[1:4], "xyz"):
                self.assertAlmostEqual(pose["position"][axis], value, places=8)
            dot = sum(a * pose["orientation"][axis] for a, axis in zip(row[4:8], "xyzw"))
            self.assertAlmostEqual(abs(dot), 1., places=8)
            transform = self.topics["/tf"][which]["transforms"][0]["transform"]
            self.assertEqual(transform["translation"], pose["position"])
        path = self.topics["/viwo/path"]["last"]["poses"]
        self.assertGreater(len(path), 5)
        self.assertGreater(self.topics["/viwo/odometry"]["last"]["pose"]["covariance"][0], 0.)

    def test_calibration_is_that_of_the_summary_and_the_table(self):
        last = self.topics["/viwo/calibration"]["last"]
        self.assertEqual(sorted(last["name"]), sorted(self.summary["calibration"]))
        for name, value, sigma in zip(last["name"], last["position"], last["effort"]):
            one = self.summary["calibration"][name]
            self.assertTrue(math.isclose(value, one["final"], rel_tol=1e-12, abs_tol=1e-15), name)
            self.assertTrue(math.isclose(sigma, one["sigma"] or 0., rel_tol=1e-12), name)
        first = self.topics["/viwo/calibration"]["first"]
        table = {row[1]: float(row[3]) for row in reversed(self.rows)}  # of the first epoch
        for name, sigma in zip(first["name"], first["effort"]):
            self.assertTrue(math.isclose(sigma, table[name], rel_tol=1e-12), name)

    def test_tracks_have_a_colour_each(self):
        for camera in "01":
            image = self.topics[f"/viwo/cam{camera}/tracks"]["last"]["points"][0]
            self.assertGreater(len(image["points"]), 10)
            self.assertEqual(len(image["points"]), len(image["outline_colors"]))
            self.assertEqual(image["type"], 1)

    def test_diagnostics_are_fine(self):
        status = self.topics["/diagnostics"]["last"]["status"][0]
        self.assertEqual(status["name"], "viwo: odometry")
        self.assertIn("sigma r_1", [one["key"] for one in status["values"]])


if __name__ == "__main__":
    RunMcap.viwo, RunMcap.source = sys.argv[1], sys.argv[2]
    if shutil.which("node") is None or not (HERE / "node_modules/@mcap/core").is_dir():
        print("skipped: needs node and scripts/install_dependencies.sh --tests (npm packages)")
        sys.exit(SKIPPED)
    unittest.main(argv=sys.argv[:1])
