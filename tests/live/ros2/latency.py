#!/usr/bin/env python3
"""How long a pose takes from its images, live by DDS: a simulated robot with a stereo pair of 848 x 800,
IMU at 200 Hz and joints at 100 Hz is recorded, played in its own time by Cyclone DDS and listened to by
viwo, on loopback and this machine alone. As the robot sees it, from when an image is given to DDS to when
the odometry has come, and as viwo tells it, from the image's arrival to the estimate. For an otherwise
idle machine. Exit code 1 where something is not as it must be: status, an image that was dropped, an
estimate that is missing, a latency beyond 10 ms in the mean or 25 ms for 99 %.

  latency.py VIWO VIWO_BAG ROS2_NODE [--camera-hz 30] [--seconds 20] [--repeat 3] [--out DIR]
"""
import argparse
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time

from loopback import CYCLONE, HERE, free_domain, listening, record

LATENCY = "latency from image to pose"
OF_SENSORS = ("ros0", "tracks0")
START_S = 3  # of images, before the first estimate
MOST_MEAN_MS, MOST_P99_MS = 10., 25.


def live_run(args, out, domain):
    """The summary of viwo's run on the bag, and the latencies [ms] that the robot has seen."""
    log = out / "live.log"
    with open(log, "w") as lines:
        viwo = subprocess.Popen(listening(args.viwo, domain, out / "live"), stdout=lines,
                                stderr=subprocess.STDOUT)
        try:
            while "listening" not in log.read_text():
                if viwo.poll() is not None:
                    raise SystemExit(log.read_text())
                time.sleep(0.05)
            seen = subprocess.run([args.ros2_node, "timed", str(domain), str(out / "robot")],
                                  env={**os.environ, **CYCLONE}, check=True, stdout=subprocess.PIPE,
                                  text=True, timeout=args.seconds + 60).stdout
            time.sleep(1)
        finally:
            viwo.send_signal(signal.SIGINT)
            code = viwo.wait(60)
    if code != 0:
        raise SystemExit(log.read_text())
    return json.loads((out / "live/summary.json").read_text()), sorted(map(float, seen.split()))


def part(values, p):
    return values[min(int(p * len(values)), len(values) - 1)]


def problems(summary, seen, trajectory, args):
    """What is not as it must be: messages that were lost or dropped, images without an estimate, poses
    that are late or were not heard."""
    if summary["status"] != "ok":
        yield f"status {summary['status']}"
    for sensor in OF_SENSORS:
        for r in summary["rejected_measurements"].get(sensor, []):
            yield f"{sensor}: {r['count']} x {r['reason']}"
    if len(seen) < (args.seconds - START_S) * args.camera_hz:
        yield f"{len(seen)} poses were heard in {args.seconds} s"
    elif sum(seen) / len(seen) > MOST_MEAN_MS or part(seen, 0.99) > MOST_P99_MS:
        yield f"more than {MOST_MEAN_MS} ms in the mean or {MOST_P99_MS} ms for 99 %"
    stamps = [float(line.split()[0]) for line in trajectory.splitlines() if line[:1] != "#"]
    if len(stamps) < (args.seconds - START_S) * args.camera_hz:
        yield f"{len(stamps)} estimates in {args.seconds} s"
    elif len(stamps) != round((stamps[-1] - stamps[0]) * args.camera_hz) + 1:
        yield f"{len(stamps)} estimates from {stamps[0]} to {stamps[-1]} s"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    for name in ("viwo", "viwo_bag", "ros2_node"):
        parser.add_argument(name)
    parser.add_argument("--camera-hz", type=float, default=30)
    parser.add_argument("--seconds", type=float, default=20, help="of the recording")
    parser.add_argument("--repeat", type=int, default=3, help="times that it is played")
    parser.add_argument("--out", type=pathlib.Path, help="keeps what was written")
    args = parser.parse_args()
    domain, _lock = free_domain()
    found = []
    with tempfile.TemporaryDirectory(prefix="viwo_latency_") as scratch:
        out = args.out or pathlib.Path(scratch)
        out.mkdir(parents=True, exist_ok=True)
        record(args.viwo, args.viwo_bag, HERE.parent / "simulate.yaml", out / "robot",
               f"sensors.simulator0.camera_rate_hz={args.camera_hz}",
               f"sensors.simulator0.duration_s={args.seconds}")
        for _ in range(args.repeat):
            summary, seen = live_run(args, out, domain)
            if seen:
                print(f"as the robot sees it [ms]: {sum(seen) / len(seen):.2f} in the mean, "
                      f"{part(seen, 0.95):.1f} for 95 %, {part(seen, 0.99):.1f} for 99 %, {seen[-1]:.1f} at "
                      f"most, {len(seen)} poses")
            print(f"{LATENCY} [ms]: {summary['timing_ms'][LATENCY]}", flush=True)
            found += problems(summary, seen, (out / "live/trajectory.tum").read_text(), args)
    for problem in found:
        print(f"PROBLEM: {problem}")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
