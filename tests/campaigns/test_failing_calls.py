#!/usr/bin/env python3
"""Commands of viwo whose n-th call to the system fails, for n = 1, 2, ...: opening, locking and
reading files, what changes the disk, mapping memory, beginning a thread, allocating; or during which
the power is lost. Either the command says what failed and of what, with exit code 1 or 2, or nothing
was lost by it and the results are those of an undisturbed one; what has the name of a result is whole;
a campaign goes on from where it was. No signal, no hang.

    test_failing_calls.py VIWO SOURCE_DIR FAILING_CALLS_LIBRARY [unittest arguments]

Of many calls a command is disturbed at each of the first ones and at a drawn number of others:
VIWO_FIRST_CALLS and VIWO_DRAWN_CALLS in the environment (300 and 200).
"""
import concurrent.futures
import csv
import json
import os
import pathlib
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest

VIWO, SOURCE, LIBRARY = (pathlib.Path(word).resolve() for word in sys.argv[1:4])
FIRST, DRAWN = (int(os.environ.get(f"VIWO_{name}_CALLS", default))
                for name, default in (("FIRST", 300), ("DRAWN", 200)))
RUNS = SOURCE / "configs/runs"

# What a line of a message says of the failing call. Of a file it may say no more than which one it is.
OF_GNUPLOT = "gnuplot failed on /"  # which is disturbed, too, and says why below
OF_FILES = f"cannot|missing|not found|are not in|{OF_GNUPLOT}"
OF_MEMORY = f"(not enough|out of|nsufficient|annot allocate|no) memory|alloc|{OF_GNUPLOT}"
REASONS = {kind: re.compile(reason) for kind, reason in {
    # Libraries do not tell why a video is not all there.
    "disk": "No space left on device|video .*: (cannot be written|it cannot be read back whole)",
    "open": f"Too many open files|{OF_FILES}",
    "read": f"Input/output error|truncated|{OF_FILES}",
    "descriptor": f"Input/output error|{OF_FILES}",
    "mmap": OF_MEMORY,
    "thread": f"(thread|gnuplot|process).*Resource temporarily unavailable|{OF_GNUPLOT}",
    "memory": f"{OF_MEMORY}|cannot be loaded: boost::dll",  # the loader has no room for more words
}.items()}
# And of what, on the same line: a path, a name, or what it wanted.
OF_WHAT = re.compile(r"(?<!\w)/\w|'[^']+'|\"[^\"]+\"|gnuplot|thread|memory|alloc|directory iterator")
# Who reads no more than this does not know what to mend.
NO_REASON = re.compile(r"^(viwo\w*: *)?(it )?(failed|(unknown |an )?error|std::\w+|basic_ios.*|iostream error)[.! ]*$",
                       re.IGNORECASE | re.MULTILINE)
# An update that fails loses an epoch, an image that is not read its tracks, and the run goes on: the user is
# told.
LOST_EPOCHS = "failed in [0-9]+ epochs?, which it skipped: .*memory"
LOST_IMAGE = "1 x image that cannot be read, first at .*the image is missing or cannot be read"
SAID = {kind: re.compile(f"{LOST_EPOCHS}|{LOST_IMAGE}" if kind in ("open", "read", "descriptor") else LOST_EPOCHS)
        for kind in REASONS}

TIMES = {"wall_s", "epoch_ms", "timing_ms", "realtime_factor", "peak_rss_mb", "epoch_p95_ms"}
EXPERIMENT = f"""\
experiment: failing
base: {RUNS}/simulated_swerve.yaml
set: {{sensors.simulator0.duration_s: 2}}
seeds: 2
variants: {{one: {{}}}}
"""
CALIBRATION = f"""\
calibration: failing
base: {RUNS}/simulated_swerve.yaml
set: {{odometry.twist: noise_weighted, sensors.simulator0.duration_s: 20}}
segment_s: 5
motions: [icr_sweep, figure_eight]
"""
SIDES = """\
model: differential
twist: plain
intrinsics:
  r_left: {estimate: 0.101, sigma: 0.001, unit: m}
  r_right: {estimate: 0.099, sigma: 0.001, unit: m}
  baseline: {estimate: 0.5, sigma: 0.01, unit: m}
"""


def without_times(value):
    if isinstance(value, dict):
        return {key: without_times(item) for key, item in value.items() if key not in TIMES}
    return [without_times(item) for item in value] if isinstance(value, list) else value


def table(file):
    """A CSV file without times."""
    with open(file, encoding="utf-8", newline="") as lines:
        rows = list(csv.reader(lines))
    kept = [i for i, name in enumerate(rows[0]) if name not in TIMES]
    return [[row[i] for i in kept] for row in rows]


def content(file):
    """All of a result that is the same in each of its runs."""
    if file.suffix == ".json":
        return without_times(json.loads(file.read_text(encoding="utf-8")))
    if file.name in ("runs.csv", "timing.csv"):
        return table(file)
    if file.suffix == ".html":
        return file.read_text(encoding="utf-8").endswith("</html>\n")
    if file.suffix == ".avi":  # OpenCV takes another of its writers where one fails
        video = file.read_bytes()
        return b"idx1" in video, video.count(b"00dc") // 2  # pictures: they and the index have it
    if "_time_of_" in file.name:  # figures of times
        return file.read_text(encoding="utf-8").endswith(("\n", "</svg>\n"))
    return file.read_bytes()


def files_below(folder):
    """Or the file that it is."""
    files = [folder] if folder.is_file() else folder.rglob("*") if folder.exists() else []
    return sorted(file.relative_to(folder) for file in files if file.is_file())


def explains(kind, text):
    """Whether a line says that such a call failed, and of what."""
    return any(REASONS[kind].search(line) and OF_WHAT.search(line) for line in text.splitlines())


def without_numbers(text, out):
    return re.sub(r"[0-9][0-9.e+-]*", "#", text.replace(str(out), "OUT"))


class Subject:
    """A command whose calls fail; OUT in its words is the folder of its results, which begins as `before`."""

    def __init__(self, *command, before=None):
        self.command, self.before = command, before

    def run(self, out, *options, kind="disk", call=0, how="error"):
        environment = dict(os.environ, LD_PRELOAD=str(LIBRARY), FAILING_FOLDER=str(out),
                           FAILING_CALL=str(call), FAILING_KIND=kind, FAILING_HOW=how,
                           FAILING_COUNT=f"{out}.count")
        out.parent.mkdir(exist_ok=True)  # of the same name each time: a bag's files have it
        if self.before and not out.exists():
            shutil.copytree(self.before, out)
        words = [str(word).replace("OUT", str(out)) for word in (*self.command, *options)]
        return subprocess.run(words, env=environment, text=True, check=False, capture_output=True,
                              timeout=120)

    def calls(self, kind, out):
        done = self.run(out, kind=kind)
        assert done.returncode in (0, 1), done.stderr
        return int(pathlib.Path(f"{out}.count").read_text()), done


class FailingCalls(unittest.TestCase):
    longMessage = False

    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="viwo_failing_"))
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        (cls.folder / "experiment.yaml").write_text(EXPERIMENT)
        (cls.folder / "calibration.yaml").write_text(CALIBRATION)
        (cls.folder / "sides.yaml").write_text(SIDES)
        for name, y in ("reference", 0), ("estimate", 0.25):
            poses = [f"{0.1 * i} {0.05 * i} {y} 0 0 0 0 1\n" for i in range(50)]
            (cls.folder / f"{name}.tum").write_text("".join(poses))

    def setUp(self):
        self.out = pathlib.Path(tempfile.mkdtemp(dir=self.folder))

    def make_log(self, name, config):
        if not (self.folder / name).exists():
            subprocess.run([VIWO, "simulate", RUNS / config, "--out", self.folder / name, "--set",
                            "sensors.simulator0.duration_s=1.5"], check=True, capture_output=True)

    def shards(self):
        """What is to be collected."""
        folder = self.folder / "shards"
        for shard in () if folder.exists() else ("0/2", "1/2"):
            subprocess.run([VIWO, "experiment", self.folder / "experiment.yaml", "--jobs", "1", "--out", folder,
                            "--shard", shard], check=True, capture_output=True)
        return folder

    def subject(self, name):
        if name in ("list", "schema"):
            return Subject(VIWO, "plugins", name)
        if name in ("run", "inspect", "bag"):
            self.make_log("log", "viwo_swerve.yaml")
        if name == "images":
            self.make_log("images", "viwo_images.yaml")
        log, images = (f"placeholders.log={self.folder / name}" for name in ("log", "images"))
        short = ("--set", "sensors.simulator0.duration_s=2")
        if name == "bag":
            return Subject(VIWO.with_name("viwo_bag"), self.folder / "log", "OUT")
        return Subject(VIWO, *{
            "run": ("run", RUNS / "viwo_log.yaml", "--set", log),
            "wheels": ("run", RUNS / "simulated_swerve.yaml", *short),
            "shown": ("run", RUNS / "viwo_swerve.yaml", "--mcap", "OUT/run.mcap", "--video",
                      "OUT/run.avi", "--set", "sensors.simulator0.duration_s=0.5"),
            "figures": ("run", RUNS / "simulated_swerve.yaml", "--figures", "svg", *short),
            "images": ("run", RUNS / "viwo_images_log.yaml", "--set", images),
            "inspect": ("inspect", RUNS / "viwo_log.yaml", "--set", log),
            "simulate": ("simulate", RUNS / "viwo_swerve.yaml", *short),
            "render": ("simulate", RUNS / "viwo_images.yaml", "--set",
                       "sensors.simulator0.duration_s=0.2"),
            "experiment": ("experiment", self.folder / "experiment.yaml", "--jobs", "1"),
            "jobs": ("experiment", self.folder / "experiment.yaml", "--jobs", "2"),
            "calibrate": ("calibrate", self.folder / "calibration.yaml"),
            "collect": ("experiment", self.folder / "experiment.yaml", "--jobs", "1", "--collect"),
            "plan": ("plan", SOURCE / "configs/plans/swerve.yaml"),
            "observability": ("observability", RUNS / "viwo_swerve.yaml", *short, "--set",
                              "sensors.simulator0.features=50"),
            "evaluate": ("evaluate", "--reference", self.folder / "reference.tum", "--estimate",
                         self.folder / "estimate.tum"),
            "export": ("export", self.folder / "sides.yaml", "--to", "csv"),
        }[name], "--out", "OUT", before=self.shards() if name == "collect" else None)

    def assert_same(self, out, whole, where):
        # A journal that is not removed is a file too many, not a wrong result.
        shutil.rmtree(out / "journal", ignore_errors=True)
        self.assertEqual(files_below(out), files_below(whole), "files are missing: " + where)
        for file in files_below(out):
            self.assertEqual(content(out / file), content(whole / file), f"{file} differs: {where}")

    def assert_whole(self, out, whole, where):
        """What is there under the name of a result is all of it; a run that failed says so."""
        there = files_below(out)
        if pathlib.Path("summary.json") in there:
            summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
            cells = summary.get("variants", {}).values()
            if summary.get("status", "ok") != "ok" or any(cell["failed"] for cell in cells):
                return
        for file in there:
            self.assertNotEqual(file.suffix, ".tmp", f"{file}: {where}")
            # An MCAP file grows while the run goes on: what cannot be written ends it, and the run says so.
            # Without memory a command may end where it is: what is unfinished goes with the next one.
            if not {"journal", "unfinished.tmp"} & set(file.parts) and file.suffix != ".mcap":
                self.assertEqual(content(out / file), content(whole / file), f"{file} differs: {where}")

    def check(self, name, kind, call, undisturbed):
        out = self.out / f"{kind}_{call}" / "out"
        where = f"{name}, {kind}, call {call}: "
        try:
            done = self.subject(name).run(out, kind=kind, call=call)
        except subprocess.TimeoutExpired:
            self.fail(where + "hangs")
        lines = done.stderr.splitlines()
        failing = [line for line in lines if line.startswith("failing_calls: ")]
        said = "\n".join(line for line in lines if line not in failing)
        where += f"{failing}, exit code {done.returncode}\n{said[-2000:]}\n{done.stdout[-1000:]}\n"
        whole = self.out / "whole" / "out"
        if done.returncode == undisturbed.returncode and (
                done.returncode == 0 or not explains(kind, said)):
            if not SAID[kind].search(done.stdout):
                self.assertEqual(without_numbers(done.stdout, out),
                                 without_numbers(undisturbed.stdout, whole),
                                 "other words: " + where)
                self.assert_same(out, whole, where)
        else:
            self.assertIn(done.returncode, (1, 2), where)
            self.assertTrue(explains(kind, said + "\n" + done.stdout), "does not say why: " + where)
            self.assertNotRegex(said, NO_REASON, "says only that it failed: " + where)
            self.assert_whole(out, whole, where)
        shutil.rmtree(out.parent, ignore_errors=True)

    def disturb(self, name, *kinds):
        subject = self.subject(name)
        for kind in kinds:
            with self.subTest(kind=kind):
                self.disturb_by(subject, name, kind)

    def disturb_by(self, subject, name, kind):
        shutil.rmtree(self.out / "whole", ignore_errors=True)
        count, undisturbed = subject.calls(kind, self.out / "whole" / "out")
        rest = range(FIRST + 1, count + 1)
        calls = [*range(1, min(FIRST, count) + 1),
                 *random.Random(1).sample(rest, min(DRAWN, len(rest)))]
        faults = []
        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            done = {pool.submit(self.check, name, kind, call, undisturbed): call
                    for call in calls}
            for each in concurrent.futures.as_completed(done):
                if each.exception():
                    faults.append(str(each.exception()))
        print(f"{name}: {len(calls)} of {count} calls ({kind}), {len(faults)} wrong")
        self.assertFalse(faults, f"{name}, {kind}: {len(faults)} of {len(calls)} calls; first:\n"
                         + "\n".join(sorted(faults)[:5]))

    def test_run(self):
        self.disturb("run", "disk", "open", "read", "descriptor", "mmap", "thread", "memory")

    def test_run_of_wheels(self):
        self.disturb("wheels", "open", "read", "memory")

    def test_run_on_images(self):
        self.disturb("images", "thread", "open", "read", "descriptor", "mmap", "memory")

    def test_experiment(self):
        self.disturb("experiment", "open", "read", "descriptor", "mmap", "memory")

    def test_experiment_of_two_jobs(self):
        self.disturb("jobs", "thread")

    def test_collect(self):
        self.disturb("collect", "disk", "open", "read", "descriptor", "mmap", "memory")

    def test_calibrate(self):
        self.disturb("calibrate", "disk", "open", "read", "descriptor", "mmap", "thread", "memory")

    def test_simulate(self):
        self.disturb("simulate", "disk", "open", "read", "descriptor", "mmap", "thread", "memory")

    def test_render(self):
        self.disturb("render", "disk")

    def test_what_shows_a_run(self):
        self.disturb("shown", "disk", "open", "read", "mmap", "thread", "memory")

    @unittest.skipUnless(shutil.which("gnuplot"), "without gnuplot")
    def test_figures(self):
        self.disturb("figures", "disk", "open", "thread", "memory")

    def test_bag(self):
        self.disturb("bag", "disk", "open", "read", "descriptor", "memory")

    def test_inspect(self):
        self.disturb("inspect", "disk", "open", "read", "memory")

    def test_plan(self):
        self.disturb("plan", "disk")

    def test_observability(self):
        self.disturb("observability", "disk", "open", "read", "mmap", "thread", "memory")

    def test_evaluate(self):
        self.disturb("evaluate", "disk", "open", "read", "descriptor", "memory")

    def test_export(self):
        self.disturb("export", "disk", "open", "read", "descriptor", "memory")

    def test_plugins(self):
        self.disturb("list", "open", "mmap")
        self.disturb("schema", "open", "read", "descriptor", "mmap", "memory")

    def test_some(self):
        for name in ("run", "simulate", "experiment", "calibrate"):
            self.disturb(name, "disk", "open", "read", "descriptor", "mmap", "memory")
        self.disturb("jobs", "thread")
        for name in ("evaluate", "export", "observability", "collect"):
            self.disturb(name, "disk", "open", "read", "memory")
        self.disturb("schema", "open", "read", "mmap")

    def test_resume_of_an_experiment(self):
        subject = self.subject("experiment")
        whole = self.out / "whole" / "out"
        count, _ = subject.calls("disk", whole)
        self.assertGreater(count, 30)
        self.each_with_and_without_power(subject, count, self.resumed)

    def test_power_of_a_run(self):
        subject = self.subject("wheels")
        count, _ = subject.calls("disk", self.out / "whole" / "out")
        self.assertGreater(count, 30)
        self.each_with_and_without_power(subject, count, lambda *_: None)

    def test_power_after_a_bag(self):
        for name in ("OUT", "OUT.mcap", "OUT.bag"):
            with self.subTest(name):
                self.subject("bag")  # its log
                subject = Subject(VIWO.with_name("viwo_bag"), self.folder / "log", name)
                folders = [self.out / f"{when}_{name}" for when in ("before", "after")]
                if "was built without ROS" in subject.run(self.out / f"probe_{name}" / "out").stderr:
                    continue
                count, _ = subject.calls("disk", folders[0] / "out")
                done = subject.run(folders[1] / "out", call=count + 1, how="power")
                self.assertEqual(done.returncode, -signal.SIGKILL, done.stderr)
                bags = [[(file, (folder / file).read_bytes()) for file in files_below(folder)
                         if file.suffix != ".count"] for folder in folders]
                self.assertTrue(bags[0] == bags[1])

    def test_collecting_again(self):
        subject = self.subject("collect")
        count, _ = subject.calls("disk", self.out / "whole" / "out")
        self.assertGreater(count, 15)
        self.each_with_and_without_power(subject, count, self.collected)

    def collected(self, subject, out, where):
        if not (out / "runs.csv").exists():  # it is there last, and the journal stays until then
            again = subject.run(out)
            self.assertEqual(again.returncode, 0, where + again.stderr)
        self.assert_same(out, self.out / "whole" / "out", where)

    def resumed(self, subject, out, where):
        again = subject.run(out, "--resume")
        self.assertEqual(again.returncode, 0, where + again.stderr)
        self.assertEqual(table(out / "runs.csv"), table(self.out / "whole/out/runs.csv"), where)
        self.assertEqual(sorted(file.name for file in out.iterdir()),
                         ["report.html", "runs.csv", "summary.json"], where)

    def each_with_and_without_power(self, subject, count, then):
        for how in ["error", "power"]:
            for call in range(1, count + 1):
                where = f"{how}, call {call} of {count}: "
                out = self.out / f"{how}_{call}" / "out"
                done = subject.run(out, call=call, how=how)
                if how == "power":
                    self.assertEqual(done.returncode, -signal.SIGKILL, where + done.stderr)
                elif "unlink of" in done.stderr and done.returncode == 0:
                    self.assert_same(out, self.out / "whole" / "out", where)  # nothing was there to go
                else:
                    self.assertEqual(done.returncode, 1, where + done.stdout + done.stderr)
                    self.assertTrue(explains("disk", done.stderr), "does not say why: " + where)
                self.assert_whole_but_for_unfinished(out, where)
                then(subject, out, where)
                shutil.rmtree(out.parent, ignore_errors=True)

    def assert_whole_but_for_unfinished(self, out, where):
        shutil.rmtree(out / "unfinished.tmp", ignore_errors=True)
        for file in out.rglob("*.tmp") if out.exists() else []:
            file.unlink()
        self.assert_whole(out, self.out / "whole" / "out", where)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[4:]], verbosity=2)
