#!/usr/bin/env python3
"""A live run for days: viwo listens by DDS to a simulated robot that drives faster than time and has
bad luck (ros2_soak.cpp). Loopback only; ends by itself. Exit code 1 where something is not as it must be:
the run ends as `diverged` or `failed` but for pieces that a fault has ended, memory grows, a topic is
not heard any more, no estimate comes at the end.

  soak.py VIWO VIWO_BAG ROS2_SOAK [--minutes 60] [--speed 20] [--seed 1] [--out DIR]
"""
import argparse
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import threading
import time

from loopback import CYCLONE, HERE, free_domain, listening, record

MOST_MB_PER_HOUR = 1.0
LEAST_HOURS_TO_FIT = 4.0  # of data: before, what a run gets once is most of what grows
MOST_MB_ONCE = 40.0
WARM_UP = 0.3  # part of the run: buffers, pieces and thinned series grow until they are full


def rss_mb(pid):
    for line in pathlib.Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) / 1024
    return None


def watch(process, samples, end):
    """(seconds of the wall, MB) twice a second."""
    begin = time.monotonic()
    while not end.wait(0.5):
        try:
            mb = rss_mb(process.pid)
        except OSError:
            return
        if mb is not None:
            samples.append((time.monotonic() - begin, mb))


def slope(samples):
    n = len(samples)
    mean_x = sum(x for x, _ in samples) / n
    mean_y = sum(y for _, y in samples) / n
    return (sum((x - mean_x) * (y - mean_y) for x, y in samples) /
            sum((x - mean_x) ** 2 for x, _ in samples))


def live_run(args, out, domain):
    """What the robot and viwo say of it, and the memory of viwo."""
    words = [*listening(args.viwo, domain, out / "live"),
             "--set", "sensors.ros0.image_topics=[/cam0/image_raw]",
             "--set", f"sensors.tracks0.cameras={HERE / 'soak_camera.yaml'}",
             "--set", f"cameras.kalibr={HERE / 'soak_camera.yaml'}",
             "--set", "sensors.tracks0.n_cameras=1", "--set", "sensors.tracks0.stereo=false"]
    samples, end = [], threading.Event()
    with open(out / "live.log", "w") as log:
        viwo = subprocess.Popen(words, stdout=log, stderr=subprocess.STDOUT)
        watcher = threading.Thread(target=watch, args=(viwo, samples, end))
        watcher.start()
        try:
            with open(out / "faults.log", "w") as faults:
                robot = subprocess.run(
                    [args.ros2_soak, str(domain), str(out / "lap"), str(60 * args.minutes),
                     str(args.speed), str(args.seed)],
                    env={**os.environ, **CYCLONE}, stdout=subprocess.PIPE,
                    stderr=faults, text=True, timeout=60 * args.minutes + 120)
        finally:
            end.set()
            watcher.join()
            viwo.send_signal(signal.SIGINT)
            code = viwo.wait(60)
    if robot.returncode != 0:
        raise SystemExit("\n".join((out / name).read_text()[-4000:]
                                   for name in ("faults.log", "live.log")))
    (out / "memory.csv").write_text("wall_s,mb\n" + "".join(f"{x:.1f},{y:.2f}\n"
                                                           for x, y in samples))
    return json.loads(robot.stdout), code, samples


def problems(heard, summary, samples, speed):
    """What is not as it must be."""
    warm = samples[int(WARM_UP * len(samples)):]
    hours = speed * (warm[-1][0] - warm[0][0]) / 3600
    mb_per_hour = slope(warm) * 3600 / speed
    print(f"memory: {samples[-1][1]:.1f} MB at the end, {mb_per_hour:+.2f} MB per hour of data "
          f"over {hours:.1f} h")
    if hours >= LEAST_HOURS_TO_FIT and mb_per_hour > MOST_MB_PER_HOUR:
        yield f"memory grows by {mb_per_hour:.2f} MB per hour of data"
    if warm[-1][1] - warm[0][1] > MOST_MB_ONCE:
        yield f"memory has grown by {warm[-1][1] - warm[0][1]:.1f} MB"
    if heard["odometry_age_s"] > 2.0 or heard["odometry"] == 0:
        yield f"the last estimate is {heard['odometry_age_s']:.1f} s old"
    if "nothing on topic" in heard["last_message"]:
        yield f"at the end, without faults: {heard['last_message']}"
    if summary["pieces"][-1].get("failure"):
        yield f"the last piece has failed: {summary['pieces'][-1]['failure']}"
    if summary["epochs"] < 0.5 * 10 * heard["data_s"]:
        yield f"{summary['epochs']} epochs in {heard['data_s']:.0f} s"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    for name in ("viwo", "viwo_bag", "ros2_soak"):
        parser.add_argument(name)
    parser.add_argument("--minutes", type=float, default=60, help="of the wall")
    parser.add_argument("--speed", type=float, default=20, help="times faster than that")
    parser.add_argument("--seed", type=int, default=1, help="of the faults")
    parser.add_argument("--out", type=pathlib.Path, help="keeps what was written")
    args = parser.parse_args()
    domain, _lock = free_domain()
    with tempfile.TemporaryDirectory(prefix="viwo_soak_") as scratch:
        out = args.out or pathlib.Path(scratch)
        out.mkdir(parents=True, exist_ok=True)
        record(args.viwo, args.viwo_bag, HERE / "soak.yaml", out / "lap")
        heard, code, samples = live_run(args, out, domain)
        summary = json.loads((out / "live/summary.json").read_text())
    print(json.dumps(heard, indent=1))
    print("latency from image to pose [ms of the wall]:",
          summary["timing_ms"]["latency from image to pose"])
    print(f"status {summary['status']} (exit code {code}), {summary['epochs']} epochs, "
          f"{len(summary['pieces'])} pieces")
    for sensor, rejected in summary["rejected_measurements"].items():
        for r in rejected:
            print(f"  {sensor}: {r['count']} x {r['reason']}")
    found = list(problems(heard, summary, samples, args.speed))
    for problem in found:
        print(f"PROBLEM: {problem}")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
