#!/usr/bin/env python3
"""make_seeds.py BUILD CORPUS

Small files to begin fuzzing with, by target, into CORPUS: by viwo's own writers where there is one.
"""
import gzip
import math
import os
import re
import shutil
import sqlite3
import struct
import subprocess
import sys
import tempfile
import zlib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FILES = Path(__file__).resolve().parent / "files"
STATE = "t,qx,qy,qz,qw,px,py,pz,vx,vy,vz,bgx,bgy,bgz,bax,bay,baz\n"


def run(*command):
    subprocess.run([str(part) for part in command], check=True, stdout=subprocess.DEVNULL)


def head(path, lines=5):
    return "".join(path.read_text().splitlines(keepends=True)[:lines])


def wpilog(records):
    """Records (entry, stamp [us], bytes), and (name, type) where an entry is started."""
    out = b"WPILOG" + struct.pack("<HI", 0x0100, 0)
    ids = {}

    def record(number, stamp, payload):
        return struct.pack("<BBHI", 0x34, number, len(payload), stamp) + payload

    def text(value):
        return struct.pack("<I", len(value)) + value.encode()

    for name, kind, stamp, payload in records:
        if name not in ids:
            ids[name] = 1 + len(ids)
            out += record(0, 0, b"\0" + struct.pack("<I", ids[name]) + text(name) + text(kind) + text(""))
        out += record(ids[name], stamp, payload)
    return out


def doubles(*values):
    return struct.pack(f"<{len(values)}d", *values)


def wpilogs():
    schemas = [("Rotation2d", "double value"), ("Translation2d", "double x;double y"),
               ("Pose2d", "Translation2d translation;Rotation2d rotation"),
               ("SwerveModuleState", "double speed;Rotation2d angle")]
    records = [(f"/.schema/struct:{name}", "structschema", 0, text.encode()) for name, text in schemas]
    for i in range(4):
        t = 1000000 + 20000 * i
        records += [("/Modules", "struct:SwerveModuleState[]", t, doubles(0.1 * i, 0.2, 0.3, 0.1 * i)),
                    ("/Pose", "struct:Pose2d", t, doubles(0.1 * i, 0., 0.2)),
                    ("/Yaw", "double", t, doubles(0.1 * i)), ("/a", "double[]", t, doubles(0., 0.1 * i, 9.8)),
                    ("/gx", "float", t, struct.pack("<f", 0.5)), ("/gy", "int64", t, struct.pack("<q", i))]
    cycles = []
    for i in range(4):
        t = 1000000 + 20000 * i
        cycles += [("/t", "int64", t, struct.pack("<q", t)), ("/d1", "double", t + 10, doubles(0.1 * i)),
                   ("/d2", "double", t + 10, doubles(0.2 * i)), ("/s1", "double", t, doubles(0.3)),
                   ("/s2", "double", t, doubles(0.3 * i)), ("/a", "double[]", t, doubles(0., 1., 0.1))]
    return wpilog(records), wpilog(cycles)


class Message:
    """A message in the making: ROS 1, or CDR of ROS 2, little endian."""

    def __init__(self, cdr):
        self.cdr, self.body = cdr, b""

    def header(self):
        self.put("I", 7) if not self.cdr else None  # sequence number
        return self.put("I", 100).put("I", 5000000).text("frame")

    def put(self, form, *values):
        size = struct.calcsize("<" + form)
        for value in values:
            if self.cdr:
                self.body += bytes(-len(self.body) % size)
            self.body += struct.pack("<" + form, value)
        return self

    def text(self, value):
        data = value.encode() + (b"\0" if self.cdr else b"")
        self.put("I", len(data))
        self.body += data
        return self

    def raw(self, data):
        self.put("I", len(data))
        self.body += data
        return self

    def bytes(self):
        return (b"\0\1\0\0" if self.cdr else b"") + self.body


def messages(cdr, png):
    def new():
        return Message(cdr).header()
    joints = new().put("I", 2).text("a").text("b").put("I", 2).put("d", 1., 2.).put("I", 2).put("d", 3., 4.)
    kinds = [
        new().put("d", *[0., 0., 0., 1.], *[0.] * 9, 1., 2., 3., *[0.] * 9, 0., 0., 9.8, *[0.] * 9),
        new().put("I", 2, 3).text("mono8").put("B", 0).put("I", 3).raw(bytes(6)),
        new().text("png").raw(png), joints.put("I", 0),
        new().put("d", 1., 2., 3., 0., 0., 0., 1.),
        new().put("d", 1., 2., 3., 0., 0., 0., 1., *[0.] * 36),
        new().text("child").put("d", 1., 2., 3., 0., 0., 0., 1., *[0.] * 36, 0.1, 0., 0., 0., 0., 0.2, *[0.] * 36),
        new().put("b", 0).put("H", 1).put("d", 45., 16., 120., *[1., 0., 0., 0., 1., 0., 0., 0., 1.]).put("B", 3)]
    out = {f"{i}": bytes([i]) + kind.bytes() for i, kind in enumerate(kinds)}
    out["8"] = bytes([8]) + kinds[6].bytes()
    frames = Message(cdr).put("I", 2)
    for child in ("imu", "camera"):
        frames.header().text(child).put("d", 1., 2., 3., 0., 0., 0.6, 0.8)
    out["9"] = bytes([9]) + frames.bytes()
    for name, size in (("rgb8", 9), ("mono16", 6), ("bayer_rggb8", 3), ("yuv422", 6)):
        out[name] = bytes([1]) + new().put("I", 2, 3).text(name).put("B", 0).put("I", size).raw(bytes(2 * size)).bytes()
    return out


def live_messages(kinds):
    """A few of each topic of live_targets.cpp, later and later."""
    topics = [(0, 0, "0"), (1, 0, "3"), (2, 0, "4"), (2, 1, "5"), (3, 0, "6"), (4, 0, "7"), (5, 0, "1"), (6, 0, "1"),
              (5, 1, "2")]
    out = b""
    for i in range(4):
        for topic, kind, name in topics:
            message = kinds[name][1:]  # four bytes (of CDR, or a sequence number), and then the stamp
            stamp = struct.pack("<II", 100, 10_000_000 * i + 1_000_000 * kind + 5_000_000)
            message = message[:4] + stamp + message[12:]
            out += bytes([topic + (0x80 if i == 2 else 0), kind]) + struct.pack("<H", len(message)) + message
    return out


def database(imu, folder):
    path = folder / "seed.db3"
    with sqlite3.connect(path) as db:
        db.execute("PRAGMA page_size=512")
        db.execute("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, "
                   "serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL)")
        db.execute("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, "
                   "timestamp INTEGER NOT NULL, data BLOB NOT NULL)")
        db.execute("INSERT INTO topics VALUES(1, '/imu0', 'sensor_msgs/msg/Imu', 'cdr', '')")
        for i in range(2):
            data = imu[:8] + struct.pack("<I", 5000000 * (i + 1)) + imu[12:]
            db.execute("INSERT INTO messages VALUES(?, 1, ?, ?)", (i + 1, 100_000_000_000 + 5_000_000 * i, data))
    db.close()
    return path.read_bytes()


def killed_log(imu, folder):
    """Pages of the log beside a bag whose recorder was killed: number, pages in all where a
    transaction ends, bytes."""
    path = folder / "killed.db3"
    shutil.copy(FILES / "killed/bag.db3", path)
    db = sqlite3.connect(path)
    for i in range(2, 5):
        data = imu[:8] + struct.pack("<I", 5000000 * (i + 1)) + imu[12:]
        db.execute("INSERT INTO messages VALUES(?, 1, ?, ?)", (i + 1, 100_000_000_000 + 5_000_000 * i, data))
        db.commit()
    log = Path(f"{path}-wal").read_bytes()
    db.close()
    frames = [log[at:at + 24 + 512] for at in range(32, len(log), 24 + 512)]
    return b"".join(frame[3:4] + frame[7:8] + frame[24:] for frame in frames)


def library(build):
    """The build record of the API in the smallest shared library: a header and a segment."""
    api = next((build / "lib").glob("libviwo_api.so.*.*")).read_bytes()
    begin = next(at for at in range(len(api)) if api.startswith(b"viwo-build-record{api=", at))
    record = api[begin:api.index(b"}", begin) + 1]
    header = struct.pack("<16sHHIQQQIHHHHHH", b"\x7fELF\2\1\1", 3, 62, 1, 0, 64, 0, 0, 64, 56, 1, 64, 0, 0)
    size = 120 + len(record)
    return header + struct.pack("<IIQQQQQQ", 1, 5, 0, 0, 0, size, size, 4096) + record


def colour_png():
    """Two pixels, and a text."""
    out = b"\x89PNG\r\n\x1a\n"
    for kind, data in ((b"IHDR", struct.pack(">IIBBBBB", 2, 1, 8, 2, 0, 0, 0)),
                       (b"zTXt", b"a\0\0" + zlib.compress(b"text")),
                       (b"IDAT", zlib.compress(bytes([0, 1, 2, 3, 200, 100, 50]))), (b"IEND", b"")):
        out += struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    return out


def motion_table(rows=24):
    """From rest to rest, forwards, sideways and turning."""
    bumps = [math.sin(math.pi * i / (rows - 1)) ** 2 if 0 < i < rows - 1 else 0 for i in range(rows)]
    return "time_s,v_x_m_per_s,v_y_m_per_s,omega_rad_per_s\n" + "".join(
        f"{0.01 * i:.2f},{0.1 * bump:.6g},{0.05 * bump:.6g},{0.2 * bump:.6g}\n" for i, bump in enumerate(bumps))


def video(jpeg, width, height, frames=2, rate_hz=20):
    """Motion JPEG in an AVI file."""
    def chunk(name, data):
        return name + struct.pack("<I", len(data)) + data + bytes(len(data) % 2)

    def listed(name, data):
        return chunk(b"LIST", name + data)
    head = struct.pack("<14I", 1_000_000 // rate_hz, 0, 0, 0x10, frames, 0, 1, 0, width, height, 0, 0, 0, 0)
    stream = struct.pack("<4s4sIHHIIIIIIII4H", b"vids", b"MJPG", 0, 0, 0, 0, 1, rate_hz, 0, frames, len(jpeg), 0, 0,
                         0, 0, width, height)
    form = struct.pack("<IiiHH4sIiiII", 40, width, height, 1, 24, b"MJPG", 3 * width * height, 0, 0, 0, 0)
    step = 8 + len(jpeg) + len(jpeg) % 2
    index = b"".join(struct.pack("<4sIII", b"00dc", 0x10, 4 + step * i, len(jpeg)) for i in range(frames))
    return chunk(b"RIFF", b"AVI " + listed(b"hdrl", chunk(b"avih", head) + listed(
        b"strl", chunk(b"strh", stream) + chunk(b"strf", form)))
        + listed(b"movi", chunk(b"00dc", jpeg) * frames) + chunk(b"idx1", index))


def main():
    if len(sys.argv) != 3 or sys.argv[1] == "--help":
        sys.exit(__doc__)
    build, corpus = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()
    folder = Path(tempfile.mkdtemp(prefix="viwo_seeds_"))
    viwo = build / "bin" / "viwo"

    def seed(target, name, data):
        (corpus / target).mkdir(parents=True, exist_ok=True)
        (corpus / target / name).write_bytes(data if isinstance(data, bytes) else data.encode())

    log = folder / "log"
    run(viwo, "simulate", FILES / "robot.yaml", "--set", "sensors.robot.duration_s=0.2", "--set",
        "sensors.robot.features=3", "--out", log)
    for target, table in (("asl_imu", "imu0"), ("asl_encoders", "wheels0"), ("asl_features", "features0"),
                          ("asl_state", "state_groundtruth_estimate0"), ("asl_pose", "poses0"),
                          ("asl_calibration", "calibration_groundtruth0")):
        path = log / table / "data.csv"
        if not path.exists():
            path = log / "state_groundtruth_estimate0" / "data.csv"
        seed(target, "simulated", head(path))
        seed(target, "euroc", head(path).replace("timestamp_ns", "#timestamp [ns]").replace(", ", ","))
    seed("asl_angles", "angles", "timestamp_ns,drive_1 [rad],drive_2 [rad],steer_1 [rad],steer_2 [rad]\n"
         + "".join(f"{10**9 + 10**7 * i},{0.3 * i},{6.2 - 0.3 * i},{0.1 * i},6.2\n" for i in range(6)))
    turning = "timestamp_ns,drive_1 [rad/s],drive_2 [rad/s]\n" + "".join(
        f"{10**9 + 50 * 10**6 * k},{v - w:.2f},{v + w:.2f}\n"
        for k, v, w in ((k, 5 * math.sin(0.04 * k) + 3, 2 * math.sin(0.1 * k)) for k in range(80)))
    seed("odometry", "turning", turning)
    seed("calibrate_wheels", "turning", turning)
    seed("asl_gnss", "fixes", (FILES / "gnss0/data.csv").read_bytes())
    seed("asl_images", "images", "timestamp_ns,filename\n1,1.png\n2,2.png\n")
    seed("gz", "one", gzip.compress(head(log / "imu0/data.csv", 20).encode(), mtime=0))
    lines = head(log / "imu0/data.csv", 20).encode()
    seed("gz", "two", gzip.compress(lines[:200], mtime=0) + gzip.compress(lines[200:], 0, mtime=0))
    seed("gz", "plain", lines)
    seed("csv_table", "all", "a,b,c,t,gx,gy,gz,ax,ay,az,x,y,yaw\n"
         + "".join(f"{i},1,{i},0.0{i},0,0,0,0,0,9.8,{i},0,0.1\n" for i in range(4)))
    seed("csv_table", "quoted", 'a;b;c;t;gx;gy;gz;ax;ay;az;x;y;yaw\n"1";1;1;0.1;0;0;0;0;0;"9.8";;;\n')
    seed("csv_table_bare", "blanks", "# text\n" + "".join(f"{1000 * i} 0.{i} 1 2  3 0 0 0 1\n" for i in range(4)))
    seed("vio_csv_imu", "a", "t,wx,wy,wz,ax,ay,az\n1521753106.7364275,1,2,3,4,5,6\n1521753106.7414277,1,2,3,4,5,7\n")
    seed("vio_csv_features", "a", "t,cam_id,feat_id,u,v\n1.7364275,1,7,10.5,20\n1.7364275,0,7,1,2\n1.74,0,9,3,4\n")
    seed("vio_csv_truth", "a", STATE + "1.7364275,0.6,0,0,0.8,1,2,3,4,5,6,7,8,9,10,11,12\n")
    seed("kaist_imu", "a", "".join(f"{10**9 + 10**7 * i},0,0,0,1,0,0,0,0.1,0,0,0,0,9.8,0,0,0\n" for i in range(3)))
    seed("kaist_wheels", "a", (FILES / "kaist/sensor_data/encoder.csv").read_bytes())
    seed("kaist_resolution", "a", (FILES / "kaist/calibration/EncoderParameter.txt").read_bytes())
    seed("kaist_images", "a", "1\n2\n")
    seed("kaist_poses", "a", "1,1,0,0,3e5,0,1,0,4e6,0,0,1,22\n2,0.8,-0.6,0,3e5,0.6,0.8,0,4e6,0,0,1,22\n")
    joints = "time;.header.stamp.secs;.header.stamp.nsecs;.name;.position;.velocity\n" + "".join(
        f"2024/05/01/10:00:00.{i}5;0;{i}50000000;['a', 'b', 'c'];[{i}, 1.0, 0.1];(0.5, 1, 0)\n" for i in range(4))
    seed("ros_text_encoders", "a", joints)
    seed("ros_text_velocity", "a", joints)
    position, orientation = ".pose.position.", ".pose.orientation."
    columns = [position + c for c in "xyz"] + [orientation + c for c in "xyzw"]
    seed("ros_text_pose", "a", "time;.header.stamp.secs;.header.stamp.nsecs;" + ";".join(columns) + "\n"
         + "".join(f"2024/05/01/10:00:0{i};{i};5;1;2;3;0;0;0;1\n" for i in range(3)))
    seed("motion_file", "a", motion_table())
    # Its frames are there: not all that the table has.
    (FILES / "video/cam0.avi").write_bytes(video((FILES / "grey.jpg").read_bytes(), 8, 8))
    seed("video_stamps", "a", "frame,timestamp_ns\n0,1000000000\n1,1050000000\n2,1100000000\n")
    modules, cycles = wpilogs()
    seed("wpilog", "modules", modules)
    seed("wpilog", "modules.gz", gzip.compress(modules, mtime=0))
    seed("wpilog_cycles", "cycles", cycles)

    for sensor, rate in (("gnss0", FILES / "gnss0"), ("cam0", FILES / "cam0")):
        shutil.copytree(rate, log / sensor, dirs_exist_ok=True)
    (log / "cam0/data.csv").write_text("timestamp_ns,filename\n1000000000,1.png\n1050000000,2.png\n")
    for table in ("imu0", "wheels0", "features0"):
        path = log / table / "data.csv"
        path.write_text(head(path, 4))
    run(build / "bin/viwo_bag", log, folder / "log.bag")
    seed("ros1_bag", "log", (folder / "log.bag").read_bytes())
    run(build / "bin/viwo_bag", log, folder / "log.mcap")
    seed("mcap", "log", (folder / "log.mcap").read_bytes())
    for name in ("lz4", "no_summary"):
        data = ROOT / "plugins/sensors/ros2_bag/test_data" / f"{name}.mcap"
        seed("mcap", name, data.read_bytes())
    run(build / "bin/viwo_bag", log, folder / "bag")
    seed("ros2_metadata", "bag", (folder / "bag/metadata.yaml").read_bytes())
    png = (FILES / "cam0/data/1.png").read_bytes()
    for target, cdr in (("ros1_message", False), ("cdr", True)):
        for name, data in messages(cdr, png).items():
            seed(target, name, data)
    seed("sqlite_bag", "imu", database(messages(True, png)["0"][1:], folder))

    seed("sqlite_log", "rows", killed_log(messages(True, png)["0"][1:], folder))
    for in_step in (0, 1, 2):
        for target, cdr in (("live_ros1", False), ("live", True)):
            seed(target, f"all_{in_step}", bytes([in_step]) + live_messages(messages(cdr, png)))

    seed("urdf", "a", "<?xml version='1.0'?>\n<robot name='r'><link name='a'/>\n<joint name='j' type='fixed'>"
         "<parent link='a'/><child link='b'/><origin xyz='0.1 0 2e-1' rpy='0 0 1.5'/></joint>\n"
         "<joint name='k' type='fixed'><parent link='b'/><child link='/c'/></joint>"
         "<joint name='w' type='continuous'><parent link='a'/><child link='w'/></joint></robot>\n")

    seed("tum", "a", "# t x y z qx qy qz qw\n1.000000001 1 2 3 0 0 0 1\n2.5 1e-3 2 3 0.6 0 0 0.8\n")
    for name in ("pinhole", "euroc", "t265_like", "kaist_urban"):
        seed("kalibr_cameras", name, (ROOT / f"configs/cameras/{name}.yaml").read_bytes())
    seed("kalibr_imu", "a", "%YAML:1.0\nimu0:\n  gyroscope_noise_density: 1e-4\n  gyroscope_random_walk: 1e-5\n"
         "  accelerometer_noise_density: 1e-3\n  accelerometer_random_walk: 1e-4\n")
    seed("image", "png", png)
    seed("image", "pgm", b"P5 3 2 255\n" + bytes(6))
    seed("image", "colour_png", colour_png())
    for name in ("grey", "progressive"):  # by cjpeg -quality 50
        seed("image", f"{name}_jpg", (FILES / f"{name}.jpg").read_bytes())
    seed("yaml", "all", "a: &x {b: [1, 'two', \"t\\u00e9\\n\"], c: ~}\n<<: *x\nd: |\n  text\n  more\ne: !!str 1\nf: - 1\n"
         .replace("f: - 1\n", "f:\n  - 1\n  - {g: *x}\n"))
    for name in ("robot", "camera"):  # to simulate takes longer than to read
        seed("run", name, re.sub(rb"duration_s: .*", b"duration_s: 0.5", (FILES / f"{name}.yaml").read_bytes()))
    seed("run", "log", "sensors: {imu: {type: asl_imu, path: imu0}, wheels: {type: asl_encoders, path: wheels0}}\n"
         "kinematics: {type: differential, radius_left_m: 0.05, radius_right_m: 0.05, baseline_m: 0.3}\n"
         "estimator: {start: moving, clones: 4}\nupdates: {wheel_odometry: {}}\n")
    seed("experiment", "a", "experiment: e\nbase: robot.yaml\nseeds: 2\nset: {odometry.twist: noise_weighted}\n"
         "variants:\n  a: {}\n  b: {estimator.clones: 5}\n")
    seed("calibrate", "a", "calibration: c\nbase: robot.yaml\nreference: poses\nsegment_s: 0.1\nfind_steering_zeros: true\n"
         "set: {sensors.robot.duration_s: 0.3, updates.gnss.enabled: false, odometry.twist: noise_weighted,\n"
         "  sensors.robot.repetition: \"{repetition}\"}\nleave_out_by: [motion]\nreport_by: [repetition]\n"
         "motions:\n  - {motion: circle, repetition: 1}\n  - {motion: icr_sweep, repetition: 2, turn_deg: 3}\n")
    seed("plan", "a", (ROOT / "configs/plans/swerve.yaml").read_bytes())
    calibrated = folder / "run"
    run(viwo, "run", FILES / "robot.yaml", "--set", "sensors.robot.duration_s=1", "--set", "updates.gnss.enabled=false",
        "--out", calibrated)
    seed("calibration", "run", (calibrated / "calibration.yaml").read_bytes())
    seed("plugin", "library", library(build))
    experiment = folder / "experiment.yaml"
    experiment.write_text(f"experiment: e\nbase: {FILES}/robot.yaml\nset: {{sensors.robot.duration_s: 0.5, "
                          "updates.gnss.enabled: false}\nvariants: {a: {}}\n")
    run(viwo, "experiment", experiment, "--shard", "1/1", "--out", folder / "experiment")
    entry = next((folder / "experiment/journal").glob("*.cbor")).read_bytes()
    seed("journal", "run", entry[entry.index(b"\x63run") + 4:entry.rindex(b"\x64seed")])

    # Of the filter a byte chooses what is next: 0 n gives 1 + n measurements as they are.
    for start in range(8):
        seed("filter", f"clean_{start}", bytes([start, 0, 63, 0, 63, 0, 63]))
        seed("filter_run", f"clean_{start}", bytes([start]) + bytes([0, 63]) * 8)
    seed("filter", "relative", bytes([0x24, 0, 63, 0, 63, 0, 63]))
    for target in ("filter", "filter_run"):
        for i in range(4):
            give = bytes([0, 40])
            spoil = b"".join(bytes([4, i, 0, k]) for k in range(12))
            seed(target, f"spoiled_{i}", bytes([4 + i]) + give * 3 + (give + spoil) * 3)
        seed(target, "offsets", bytes([4, 0, 63, 3, 2, 5, 0, 0, 63, 3, 2, 0xff, 0x7f, 0, 63, 3, 0, 2, 0, 9]))
        seed(target, "back", bytes([4, 0, 63, 2, 30, 0, 40, 1, 20, 0, 63, 2, 63, 0, 63]))
    shutil.rmtree(folder)
    return 0


if __name__ == "__main__":
    sys.exit(main())
