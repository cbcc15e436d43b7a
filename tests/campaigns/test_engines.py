#!/usr/bin/env python3
"""Campaigns by the engines that people have: an array of a real Slurm with a task that is killed and
requeued, and the ranks of a real mpirun. Both give the runs.csv of one run, but for times.

    test_engines.py VIWO SOURCE_DIR [unittest arguments]
"""
import csv
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

import one_node_slurm

VIWO, SOURCE = (pathlib.Path(word).resolve() for word in sys.argv[1:3])
TIMES = {"wall_s", "epoch_ms"}
SKIPPED = 77  # SKIP_RETURN_CODE of the test

EXPERIMENT = f"""\
experiment: engines
base: {SOURCE}/configs/runs/viwo_swerve.yaml
set: {{sensors.simulator0.duration_s: 20}}
seeds: 6
variants:
  calibrated: {{}}
  held: {{wheels.calibrate_intrinsics: false}}
"""


class Campaign(unittest.TestCase):
    def setUp(self):
        # Other users of the machine, such as Slurm's, must see it.
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="viwo_engines_"))
        self.folder.chmod(0o755)
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        self.experiment = self.folder / "experiment.yaml"
        self.experiment.write_text(EXPERIMENT)

    def viwo(self, out, *options):
        done = subprocess.run([VIWO, "experiment", self.experiment, "--out", self.folder / out,
                               *options], text=True, check=False, capture_output=True)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def table(self, out):
        with open(self.folder / out / "runs.csv", encoding="utf-8", newline="") as file:
            rows = list(csv.reader(file))
        kept = [i for i, name in enumerate(rows[0]) if name not in TIMES]
        self.assertEqual(len(rows[0]) - len(kept), len(TIMES))
        return [[row[i] for i in kept] for row in rows]

    def assert_collects_to_one_run(self, out):
        self.viwo(out, "--collect")
        self.assertFalse((self.folder / out / "journal").exists())
        self.viwo("whole")
        self.assertEqual(len(self.table("whole")), 1 + 12)
        self.assertEqual(self.table(out), self.table("whole"))


class Slurm(Campaign):
    def setUp(self):
        if lacking := one_node_slurm.missing():
            self.skipTest(lacking)
        super().setUp()

    def test_an_array_of_which_a_task_is_killed_and_requeued(self):
        journal = self.folder / "out" / "journal"
        with one_node_slurm.OneNodeSlurm(self.folder / "slurm") as slurm:
            job = slurm.run("sbatch", "--parsable", "--array=0-2", "--requeue", "--mem=0",
                            f"--output={self.folder}/task_%a.txt", "--open-mode=append",
                            str(SOURCE / "configs/cluster/slurm.sh"), VIWO=str(VIWO),
                            EXPERIMENT=str(self.experiment), OUT=str(self.folder / "out")).strip()
            # In the middle of its cells.
            slurm.wait_for(lambda: list(journal.glob("*,1.cbor")), 60)
            slurm.run("scontrol", "requeue", f"{job}_0")

            def is_requeued():
                task = slurm.run("scontrol", "show", "job", f"{job}_0")
                return "Restarts=1" in task and "JobState=PENDING" in task

            slurm.wait_for(is_requeued, 60)
            slurm.run("scontrol", "update", f"JobId={job}_0", "StartTime=now")
            slurm.wait_for(lambda: not slurm.run("squeue", "-h").strip(), 300)
        said = (self.folder / "task_0.txt").read_text(encoding="utf-8")
        self.assertIn("taken over from an interrupted experiment", said)
        self.assert_collects_to_one_run("out")


class Mpi(Campaign):
    def setUp(self):
        if shutil.which("mpirun") is None:
            self.skipTest("mpirun not found: apt-get install openmpi-bin")
        super().setUp()

    def test_the_ranks_of_mpirun(self):
        done = subprocess.run(
            ["mpirun", "--allow-run-as-root", "--oversubscribe", "--host", "localhost:3",
             "--mca", "btl", "self", "-n", "3",
             VIWO, "experiment", self.experiment, "--out", self.folder / "out", "--jobs", "1",
             "--shard", "OMPI_COMM_WORLD_RANK/OMPI_COMM_WORLD_SIZE"],
            env=dict(os.environ, OMPI_MCA_plm_rsh_agent="false"), text=True, check=False,
            capture_output=True)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        for rank in range(3):
            self.assertIn(f"shard {rank} of 3: 4 of 12 runs", done.stdout)
        self.assert_collects_to_one_run("out")


if __name__ == "__main__":
    result = unittest.main(argv=[sys.argv[0], *sys.argv[3:]], exit=False, verbosity=2).result
    if not result.wasSuccessful():
        sys.exit(1)
    sys.exit(SKIPPED if result.skipped else 0)
