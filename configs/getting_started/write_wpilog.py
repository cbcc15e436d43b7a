#!/usr/bin/env python3
"""write_wpilog.py LOG_FOLDER OUT.wpilog: wheels and gyro of a log folder as an FRC robot logs them.

Makes a recording to try docs/getting_started.md with: SwerveModuleState[] in metres per second of a
program that takes the wheels for 51 mm, and the yaw of a gyro.
"""
import csv
import pathlib
import struct
import sys

WHEEL_RADIUS_M = 0.051
# Front left, front right, back left, back right, of front left and on counterclockwise.
ORDER_OF_WPILIB = (0, 3, 1, 2)
MODULES, YAW, SCHEMA_ROTATION, SCHEMA_MODULE = 1, 2, 3, 4


def record(entry, t_us, payload):
    return struct.pack("<BBIQ", 0x7F & (0 | 3 << 2 | 7 << 4), entry, len(payload), t_us) + payload


def text(value):
    data = value.encode()
    return struct.pack("<I", len(data)) + data


def start(entry, name, kind):
    return record(0, 0, struct.pack("<BI", 0, entry) + text(name) + text(kind) + text(""))


def rows(file):
    with open(file, newline="") as lines:
        reader = csv.reader(lines)
        next(reader)
        for row in reader:
            yield int(row[0]) // 1000, [float(value) for value in row[1:]]


def main():
    folder, out = pathlib.Path(sys.argv[1]), sys.argv[2]
    records = []
    for t_us, values in rows(folder / "wheels0" / "data.csv"):
        n = len(values) // 2
        states = b"".join(struct.pack("<dd", WHEEL_RADIUS_M * values[i], values[n + i]) for i in ORDER_OF_WPILIB)
        records.append((t_us, record(MODULES, t_us, states)))
    yaw = 0.0
    before = None
    for t_us, values in rows(folder / "imu0" / "data.csv"):
        if before is not None:
            yaw += 0.5e-6 * (t_us - before[0]) * (values[2] + before[1])
        before = (t_us, values[2])
        records.append((t_us, record(YAW, t_us, struct.pack("<d", yaw))))
    with open(out, "wb") as log:
        log.write(b"WPILOG" + struct.pack("<HI", 0x0100, 0))
        log.write(start(SCHEMA_ROTATION, "/.schema/struct:Rotation2d", "structschema"))
        log.write(record(SCHEMA_ROTATION, 0, b"double value"))
        log.write(start(SCHEMA_MODULE, "/.schema/struct:SwerveModuleState", "structschema"))
        log.write(record(SCHEMA_MODULE, 0, b"double speed;Rotation2d angle"))
        log.write(start(MODULES, "/Drive/ModuleStates", "struct:SwerveModuleState[]"))
        log.write(start(YAW, "/Drive/GyroYaw", "double"))
        for _, data in sorted(records, key=lambda item: item[0]):
            log.write(data)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main()
