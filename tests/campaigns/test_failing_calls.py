#!/usr/bin/env python3
"""A small experiment and a run whose n-th call to the disk fails, or during which the power is lost
there, for every n: what has the name of a result is whole, what could not be written is an error,
and going on gives what an undisturbed experiment gives, but for times.

    test_failing_calls.py VIWO SOURCE_DIR FAILING_CALLS_LIBRARY [unittest arguments]
"""
import csv
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest

VIWO, SOURCE, LIBRARY = (pathlib.Path(word).resolve() for word in sys.argv[1:4])
TIMES = {"wall_s", "epoch_ms"}
EXPERIMENT = f"""\
experiment: failing
base: {SOURCE}/configs/runs/simulated_swerve.yaml
set: {{sensors.simulator0.duration_s: 2}}
seeds: 2
variants: {{one: {{}}}}
"""


def table(file):
    """runs.csv without times."""
    with open(file, encoding="utf-8", newline="") as lines:
        rows = list(csv.reader(lines))
    kept = [i for i, name in enumerate(rows[0]) if name not in TIMES]
    return [[row[i] for i in kept] for row in rows]


class EveryCall(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="viwo_failing_"))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        (self.folder / "experiment.yaml").write_text(EXPERIMENT)

    def viwo(self, command, out, *options, call=0, how="disk"):
        environment = dict(os.environ, LD_PRELOAD=str(LIBRARY), FAILING_FOLDER=str(out),
                           FAILING_CALL=str(call), FAILING_HOW=how,
                           FAILING_COUNT=str(self.folder / "count"))
        # One job: the n-th call is then always the same.
        return subprocess.run([VIWO, *command, "--out", out, *options], env=environment, text=True,
                              check=False, capture_output=True, timeout=120)

    def calls_of(self, command, out, *options):
        done = self.viwo(command, out, *options)
        self.assertEqual(done.returncode, 0, done.stderr)
        return int((self.folder / "count").read_text())

    def assert_failed_or_warned(self, done, how, where):
        if how == "power":
            self.assertEqual(done.returncode, -signal.SIGKILL, where + done.stderr)
            return
        self.assertEqual(done.returncode, 1, where + done.stdout + done.stderr)
        self.assertIn("No space left on device", done.stderr, where)

    def assert_whole(self, out, whole, where):
        """What is there under the name of a result is all of it."""
        for name in whole:
            file = out / name
            if not file.exists():
                continue
            if name.endswith(".json"):
                json.loads(file.read_text(encoding="utf-8"))
            elif name == "runs.csv":
                self.assertEqual(table(file), table(self.folder / "whole" / name), where + name)
            elif name.endswith(".html"):
                self.assertTrue(file.read_text(encoding="utf-8").endswith("</html>\n"), where + name)
            elif name != "timing.csv":
                self.assertEqual(file.read_bytes(), (self.folder / "whole" / name).read_bytes(),
                                 where + name)

    def test_of_an_experiment(self):
        command = ["experiment", self.folder / "experiment.yaml", "--jobs", "1"]
        count = self.calls_of(command, self.folder / "whole")
        self.assertGreater(count, 30)
        for how in ["disk", "power"]:
            for call in range(1, count + 1):
                where = f"{how}, call {call} of {count}: "
                out = self.folder / f"{how}_{call}"
                done = self.viwo(command, out, call=call, how=how)
                self.assert_failed_or_warned(done, how, where)
                self.assert_whole(out, ["runs.csv", "summary.json", "report.html"], where)
                again = self.viwo(command, out, "--resume")
                self.assertEqual(again.returncode, 0, where + again.stderr)
                self.assertEqual(table(out / "runs.csv"), table(self.folder / "whole/runs.csv"),
                                 where)
                self.assertEqual(sorted(file.name for file in out.iterdir()),
                                 ["report.html", "runs.csv", "summary.json"], where)
                shutil.rmtree(out)

    def test_of_a_run(self):
        command = ["run", SOURCE / "configs/runs/simulated_swerve.yaml",
                   "--set", "sensors.simulator0.duration_s=2"]
        count = self.calls_of(command, self.folder / "whole")
        self.assertGreater(count, 30)
        names = sorted(file.name for file in (self.folder / "whole").iterdir())
        for how in ["disk", "power"]:
            for call in range(1, count + 1):
                where = f"{how}, call {call} of {count}: "
                out = self.folder / f"{how}_{call}"
                done = self.viwo(command, out, call=call, how=how)
                self.assert_failed_or_warned(done, how, where)
                self.assert_whole(out, names, where)
                shutil.rmtree(out, ignore_errors=True)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[4:]], verbosity=2)
