#!/usr/bin/env python3
"""mutate_inputs.py BIN SOURCE WORK [--count N] [--formats A,B]: the whole program on broken inputs.

Small recordings of every format that is read, configurations of a recording, and a plugin's file, N
mutations of each (200). (A robot description is read from live topics alone: tests/fuzz.) Each run
must end with exit code 0, 1 or 2, say why where it is not 0, and stay within 20 s of CPU, two
minutes and 512 MB. Formats whose programs or sensors are not built are left out, and said.
"""

import argparse
import gzip
import os
import pathlib
import random
import resource
import shutil
import signal
import sqlite3
import struct
import subprocess
import sys
import threading

MOST_MB = 512
MOST_CPU_S = 20
MOST_WALL_S = 120  # of one that waits for something
# Beside these the last line of defence: no mutation may even ask for more.
MOST_ADDRESSES = 4 << 30

WHEELS = """
kinematics:
  type: four_wis_wid
  x_m: [0.1125, -0.1125, -0.1125, 0.1125]
  y_m: [0.1125, 0.1125, -0.1125, -0.1125]
  radius_m: 0.0255
"""
DRIVES = [f'drive_{i}' for i in range(1, 5)]
STEERS = [f'steer_{i}' for i in range(1, 5)]
JOINTS = f'drive_joints: [{", ".join(DRIVES)}], steer_joints: [{", ".join(STEERS)}]'
HEADS = {'imu.csv': 't,wx,wy,wz,ax,ay,az', 'features.csv': 't,cam_id,feat_id,u,v',
         'groundtruth.csv': 't,qx,qy,qz,qw,px,py,pz,vx,vy,vz,bgx,bgy,bgz,bax,bay,baz'}
# What stands in text where a number was.
NUMBERS = [b'9223372036854775807', b'-9223372036854775808', b'1e308', b'-1e400', b'nan', b'inf',
           b'0', b'-1', b'', b'1' * 400, b'4294967296', b'0.1e-320', b'"', b'\xff', b'[' * 50]


class Failure(Exception):
    pass


def run(command, **kwargs):
    subprocess.run([str(word) for word in command], check=True, stdout=subprocess.DEVNULL,
                   **kwargs)


class Inputs:
    """Whole recordings, made once."""

    def __init__(self, bin_folder, source, work):
        self.bin, self.source, self.work = bin_folder, source, work
        self.viwo = bin_folder / 'viwo'
        self.whole = work / 'whole'
        shutil.rmtree(work, ignore_errors=True)
        self.whole.mkdir(parents=True)
        self.log = self.simulate('viwo_swerve', 'log', 'duration_s=3')
        self.rows = [line.split(',') for line in
                     (self.log / 'wheels0/data.csv').read_text().splitlines()[1:]]

    def simulate(self, name, out, *settings):
        sets = [word for setting in settings
                for word in ('--set', f'sensors.simulator0.{setting}')]
        run([self.viwo, 'simulate', self.source / f'configs/runs/{name}.yaml', '--out',
             self.whole / out] + sets, stderr=subprocess.DEVNULL)
        return self.whole / out

    def has_plugin(self, kind, name):
        return any(self.bin.parent.glob(f'lib/viwo/plugins/*/libviwo_{kind}_{name}.so'))

    def config(self, name, text):
        file = self.work / f'{name}.yaml'
        file.write_text(f'name: {name}\n{text}')
        return file

    def wheels_run(self, name, sensor):
        """The command that runs the wheels alone, by one sensor."""
        file = self.config(name, f'sensors: {{wheels0: {sensor}}}\n{WHEELS}')
        return [self.viwo, 'run', file, '--out', self.work / 'out' / name]


# Each format: (the command, the folder or file it reads, the files in it that are mutated).

def asl(inputs):
    log = inputs.work / 'asl'
    shutil.copytree(inputs.log, log)
    return ([inputs.viwo, 'run', inputs.source / 'configs/runs/viwo_log.yaml', '--set',
             f'placeholders.log={log}', '--out', inputs.work / 'out/asl'], sorted(log.rglob('*.csv')))


def gz(inputs):
    file = inputs.work / 'wheels.csv.gz'
    file.write_bytes(gzip.compress((inputs.log / 'wheels0/data.csv').read_bytes()))
    return inputs.wheels_run('gz', f'{{type: asl_encoders, path: {file}}}'), [file]


def csv_table(inputs):
    file = inputs.work / 'table.csv'
    file.write_text('t;' + ';'.join(DRIVES + STEERS) + '\n' +
                    '\n'.join(';'.join([str(int(row[0]) / 1e9)] + row[1:]) for row in inputs.rows))
    sensor = (f'{{type: csv_table, path: {file}, time_column: t, time_unit: s, '
              f'drive_columns: [{", ".join(DRIVES)}], steer_columns: [{", ".join(STEERS)}]}}')
    return inputs.wheels_run('csv_table', sensor), [file]


def ros_text(inputs):
    file = inputs.work / 'joints.csv'
    lines = ['time;.header.stamp.secs;.header.stamp.nsecs;.name;.position;.velocity']
    for row in inputs.rows:
        seconds, nanoseconds = divmod(int(row[0]), 10**9)
        names = ', '.join(f"'{name}'" for name in DRIVES + STEERS)
        lines.append(f'2026/01/01/10:00:00.0;{seconds};{nanoseconds};[{names}];'
                     f'[0, 0, 0, 0, {", ".join(row[5:9])}];[{", ".join(row[1:5])}, 0, 0, 0, 0]')
    file.write_text('\n'.join(lines) + '\n')
    sensor = (f'{{type: ros_text_encoders, path: {file}, drive: [{", ".join(DRIVES)}], '
              f'steer: [{", ".join(STEERS)}], drive_input: velocity}}')
    return inputs.wheels_run('ros_text', sensor), [file]


def run_yaml(inputs):
    """On a recording, which bounds what even a wrong configuration can ask for."""
    file = inputs.work / 'run.yaml'
    text = (inputs.source / 'configs/runs/viwo_log.yaml').read_text()
    file.write_text(text.replace('../cameras', f'{inputs.source}/configs/cameras'))
    return ([inputs.viwo, 'run', file, '--set', f'placeholders.log={inputs.log}', '--out',
             inputs.work / 'out/run_yaml'], [file])


def experiment_yaml(inputs):
    """Likewise, without a number of seeds, which would be one of runs."""
    base = inputs.config('experiment_base', 'sensors: {wheels0: {type: asl_encoders, path: '
                         f'{inputs.log}/wheels0}}}}\n{WHEELS}odometry: {{epoch_s: 0.1}}\n')
    file = inputs.work / 'experiment_of_two.yaml'
    file.write_text(f'''\
experiment: two
base: {base}
set: {{odometry.epoch_s: 0.05}}
baseline: plain
variants:
  plain: {{}}
  weighted: {{odometry.twist: noise_weighted}}
''')
    return [inputs.viwo, 'experiment', file, '--jobs', '1', '--out',
            inputs.work / 'out/experiment_yaml'], [file]


def kalibr(inputs):
    file = inputs.work / 'chain.yaml'
    shutil.copy(inputs.source / 'configs/cameras/t265_like.yaml', file)
    return ([inputs.viwo, 'run', inputs.source / 'configs/runs/viwo_log.yaml', '--set',
             f'placeholders.log={inputs.log}', '--set', f'cameras.kalibr={file}', '--out',
             inputs.work / 'out/kalibr'], [file])


def vio_csv(inputs):
    """IMU, features and states in the tables of other simulators, noises in Kalibr's file."""
    folder = inputs.work / 'vio'
    folder.mkdir()
    noises = inputs.work / 'imu.yaml'
    noises.write_text('rostopic: /imu0\nupdate_rate: 200.0\naccelerometer_noise_density: 2.0e-3\n'
                      'accelerometer_random_walk: 3.0e-3\ngyroscope_noise_density: 1.7e-4\n'
                      'gyroscope_random_walk: 2.0e-5\n')

    def table(name, source, columns):
        rows = [line.split(',') for line in (inputs.log / source).read_text().splitlines()[1:]]
        text = '\n'.join(','.join([f'{int(row[0]) / 1e9:.9f}'] + [row[i] for i in columns])
                         for row in rows)
        (folder / name).write_text(HEADS[name] + '\n' + text + '\n')
    table('imu.csv', 'imu0/data.csv', range(1, 7))
    table('features.csv', 'features0/data.csv', range(1, 5))
    table('groundtruth.csv', 'state_groundtruth_estimate0/data.csv',
          [5, 6, 7, 4, 1, 2, 3, *range(8, 17)])
    config = inputs.config('vio_csv', f'''sensors: {{export0: {{type: vio_csv, folder: {folder}}}}}
cameras: {{kalibr: {inputs.source}/configs/cameras/t265_like.yaml}}
imu: {{kalibr: {noises}}}
estimator: {{start: reference}}
updates: {{visual_features: {{}}}}
''')
    return ([inputs.viwo, 'run', config, '--out', inputs.work / 'out/vio_csv'],
            sorted(folder.glob('*')) + [noises])


def kaist_urban(inputs):
    """A car on a circle: wheels that count, and its poses."""
    folder = inputs.work / 'kaist'
    for name in ('sensor_data', 'calibration'):
        (folder / name).mkdir(parents=True)
    stamps = [1544581170000000000 + 10_000_000 * k for k in range(500)]
    (folder / 'sensor_data/encoder.csv').write_text(
        ''.join(f'{t},{5000 + 40 * k},{7000 + 45 * k}\n' for k, t in enumerate(stamps)))
    (folder / 'global_pose.csv').write_text(
        ''.join(f'{t},1,0,0,{k / 50},0,1,0,7,0,0,1,22\n' for k, t in enumerate(stamps)))
    (folder / 'calibration/EncoderParameter.txt').write_text(
        'Encoder calibrated parameter\nEncoder resolution: 4096\n'
        'Encoder left wheel diameter: 0.623479\nEncoder right wheel diameter: 0.622806\n'
        'Encoder wheel base: 1.52439\n')
    config = inputs.config('kaist_urban', f'''\
sensors: {{kaist0: {{type: kaist_urban, path: {folder}, imu: false, images: false}}}}
kinematics: {{type: differential, radius_left_m: 0.3117, radius_right_m: 0.3114, baseline_m: 1.524}}
''')
    return ([inputs.viwo, 'run', config, '--out', inputs.work / 'out/kaist_urban'],
            sorted(file for file in folder.rglob('*') if file.is_file()))


def journal(inputs):
    """A shard that is started again."""
    config = inputs.work / 'experiment.yaml'
    config.write_text(f'''\
experiment: journal
base: {inputs.source}/configs/runs/simulated_swerve.yaml
set: {{sensors.simulator0.duration_s: 2}}
seeds: 4
variants: {{one: {{}}}}
''')
    out = inputs.work / 'out/journal'
    command = [inputs.viwo, 'experiment', config, '--shard', '0/2', '--out', out]
    run(command, stderr=subprocess.DEVNULL)
    return command, sorted((out / 'journal').glob('*.cbor'))


def tum(inputs):
    files = [inputs.work / 'a.tum', inputs.work / 'b.tum']
    for file in files:
        file.write_text(''.join(f'{k / 10} {k} {k % 7} 0 0 0 0 1\n' for k in range(200)))
    return [inputs.viwo, 'evaluate', '--reference', files[0], '--estimate', files[1], '--out',
            inputs.work / 'out/tum'], files


def bag(inputs, name, sensor):
    if not inputs.has_plugin('sensor', sensor) or not (inputs.bin / 'viwo_bag').exists():
        return None
    file = inputs.work / name
    run([inputs.bin / 'viwo_bag', inputs.log, file])
    return (inputs.wheels_run(name.replace('.', '_'), f'{{type: {sensor}, path: {file}, '
                              f'joint_topic: /joint_states, {JOINTS}}}'), [file])


def ros1(inputs):
    return bag(inputs, 'robot.bag', 'ros1_bag')


def mcap(inputs):
    return bag(inputs, 'robot.mcap', 'ros2_bag')


def ros2_metadata(inputs):
    made = bag(inputs, 'robot_folder', 'ros2_bag')
    return made and (made[0], [made[1][0] / 'metadata.yaml'])


def cdr_joints(row):
    """sensor_msgs/JointState."""
    seconds, nanoseconds = divmod(int(row[0]), 10**9)
    out = struct.pack('<iIIxxxx', seconds, nanoseconds, 1)[:13]

    def align(size):
        nonlocal out
        out += b'\0' * (-len(out) % size)

    def number(value):
        nonlocal out
        align(4)
        out += struct.pack('<I', value)
    number(8)
    for name in DRIVES + STEERS:
        number(len(name) + 1)
        out += name.encode() + b'\0'
    zeros = [0.] * 4
    for values in (zeros + [float(x) for x in row[5:9]], [float(x) for x in row[1:5]] + zeros, []):
        number(len(values))
        if values:
            align(8)
        out += struct.pack(f'<{len(values)}d', *values)
    return b'\0\1\0\0' + out


def sqlite(inputs):
    if not inputs.has_plugin('sensor', 'ros2_bag'):
        return None
    file = inputs.work / 'robot.db3'
    database = sqlite3.connect(file)
    database.executescript(
        'CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, '
        'serialization_format TEXT, offered_qos_profiles TEXT);'
        'CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, '
        'data BLOB); CREATE INDEX timestamp_idx ON messages (timestamp ASC);'
        "INSERT INTO topics VALUES(1, '/joint_states', 'sensor_msgs/msg/JointState', 'cdr', '')")
    database.executemany('INSERT INTO messages(topic_id, timestamp, data) VALUES(1, ?, ?)',
                         [(int(row[0]), cdr_joints(row)) for row in inputs.rows])
    database.commit()
    database.close()
    return inputs.wheels_run('sqlite', f'{{type: ros2_bag, path: {file}, '
                             f'joint_topic: /joint_states, {JOINTS}}}'), [file]


def wpilog(inputs):
    file = inputs.work / 'robot.wpilog'

    def text(value):
        return struct.pack('<I', len(value)) + value.encode()
    out = b'WPILOG' + struct.pack('<HI', 0x0100, 0)
    entries = DRIVES + STEERS
    for i, name in enumerate(entries, 1):
        payload = b'\0' + struct.pack('<I', i) + text('/' + name) + text('double') + text('')
        out += struct.pack('<BBBB', 0, 0, len(payload), 0) + payload
    for row in inputs.rows:
        for i, value in enumerate(row[1:9], 1):
            out += struct.pack('<BBBQd', 0x70, i, 8, int(row[0]) // 1000, float(value))
    file.write_bytes(out)
    quoted = ['"/' + name + '"' for name in entries]
    sensor = (f'{{type: wpilog, path: {file}, drive_entries: [{", ".join(quoted[:4])}], '
              f'steer_entries: [{", ".join(quoted[4:])}], drive_unit: rad}}')
    return inputs.wheels_run('wpilog', sensor), [file]


def png(inputs):
    log = inputs.simulate('viwo_images', 'images', 'duration_s=0.5')
    copy = inputs.work / 'png'
    shutil.copytree(log, copy)
    return ([inputs.viwo, 'run', inputs.source / 'configs/runs/viwo_images_log.yaml', '--set',
             f'placeholders.log={copy}', '--out', inputs.work / 'out/png'],
            sorted(copy.rglob('*.png')) + sorted(copy.glob('cam*/data.csv')))


def grey_jpeg(width, height):
    """Of one grey: each of its blocks is two bits."""
    def segment(marker, data):
        return struct.pack('>BBH', 0xff, marker, len(data) + 2) + data
    blocks = -(-width // 8) * -(-height // 8)
    code = bytes([1]) + bytes(15) + b'\0'
    return (b'\xff\xd8' + segment(0xdb, b'\0' + b'\1' * 64) +
            segment(0xc0, struct.pack('>BHHBBBB', 8, height, width, 1, 1, 0x11, 0)) +
            segment(0xc4, b'\0' + code) + segment(0xc4, b'\x10' + code) +
            segment(0xda, b'\1\1\0\0\x3f\0') + bytes(-(-blocks // 4)) + b'\xff\xd9')


def jpeg(inputs):
    """One of each camera among images of a log: a file is known by what is in it."""
    log = inputs.simulate('viwo_images', 'jpegs', 'duration_s=0.5')
    files = [max((log / camera / 'data').glob('*.png')) for camera in ('cam0', 'cam1')]
    for file in files:
        width, height = struct.unpack('>II', file.read_bytes()[16:24])
        file.write_bytes(grey_jpeg(width, height))
    return ([inputs.viwo, 'run', inputs.source / 'configs/runs/viwo_images_log.yaml', '--set',
             f'placeholders.log={log}', '--out', inputs.work / 'out/jpeg'], files)


def gnss(inputs):
    """Fixes of a receiver beside a log, whose origin is somewhere on the Earth."""
    if not inputs.has_plugin('update', 'gnss'):
        return None
    file = inputs.work / 'gnss0/data.csv'
    file.parent.mkdir()
    truth = (inputs.log / 'state_groundtruth_estimate0/data.csv').read_text().splitlines()[1::4]
    lines = ['timestamp_ns,latitude [deg],longitude [deg],altitude [m],cov_EE [m^2],cov_EN,cov_EU,'
             'cov_NE,cov_NN,cov_NU,cov_UE,cov_UN,cov_UU']
    for row in truth:
        stamp, x, y, z = row.split(',')[:4]
        lines.append(f'{stamp},{48 + float(y) / 111e3:.9f},{11 + float(x) / 74.5e3:.9f},'
                     f'{500 + float(z)},1e-4,0,0,0,1e-4,0,0,0,1e-4')
    file.write_text('\n'.join(lines) + '\n')
    return ([inputs.viwo, 'run', inputs.source / 'configs/runs/viwo_log.yaml', '--set',
             f'placeholders.log={inputs.log}', '--set',
             f'sensors.gnss0={{type: asl_gnss, path: {file.parent}}}', '--set', 'updates.gnss={}',
             '--out', inputs.work / 'out/gnss'], [file])


def calibration(inputs):
    """What a run has found, and another one starts from."""
    log = inputs.source / 'configs/runs/viwo_log.yaml'
    found = inputs.whole / 'found'
    from_log = [inputs.viwo, 'run', log, '--set', f'placeholders.log={inputs.log}']
    run(from_log + ['--out', found], stderr=subprocess.DEVNULL)
    file = inputs.work / 'calibration.yaml'
    shutil.copy(found / 'calibration.yaml', file)
    return from_log + ['--set', f'kinematics.calibration={file}', '--out',
                       inputs.work / 'out/calibration'], [file]


def plugin(inputs):
    # A build folder may have plugins of earlier versions, too.
    whole = max(inputs.bin.parent.glob('lib/viwo/plugins/*/libviwo_kinematics_differential.so'),
                key=os.path.getmtime)
    file = inputs.work / whole.name
    shutil.copy(whole, file)
    return [inputs.viwo, 'plugins', 'check', file], [file]


FORMATS = {f.__name__: f for f in (asl, gz, csv_table, ros_text, vio_csv, kaist_urban, run_yaml,
                                   experiment_yaml, kalibr, tum, ros1, mcap, ros2_metadata, sqlite,
                                   wpilog, png, jpeg, gnss, calibration, journal, plugin)}


def mutated(whole, rng):
    out = bytearray(whole)
    for _ in range(rng.choice([1, 1, 2, 5])):
        # Headers are where the most is decided.
        reach = len(out) if rng.random() < 0.7 else min(len(out), 512)
        at, n = rng.randrange(max(reach, 1)), rng.choice([1, 4, 8, 64, 500])
        kind = rng.randrange(8)
        if kind == 0:
            out[at:at + n] = rng.randbytes(min(n, len(out) - at))
        elif kind == 1:
            out[at:at + n] = bytes([rng.choice([0, 0xff, 0x7f])]) * min(n, len(out) - at)
        elif kind == 2:
            out[at:at + 1] = bytes([(out[at] ^ (1 << rng.randrange(8))) if at < len(out) else 0])
        elif kind == 3:
            del out[at:at + n]
        elif kind == 4:
            out[at:at] = out[at:at + n] * rng.choice([1, 3, 100])
        elif kind == 5:
            del out[at:]
        elif kind == 6:
            out[at:at + n] = rng.choice(NUMBERS)
        else:
            out[at:at + 8] = rng.choice([b'\xff' * 8, b'\0' * 7 + b'\x80', b'\xff' * 7 + b'\x7f',
                                         struct.pack('<II', 1 << 31, 1 << 30)])
    return bytes(out)


def mutated_file(whole, suffix, rng):
    """What is in a gzipped file is broken as often as the file: its check sum hides all else."""
    if suffix != '.gz' or rng.random() < 0.5:
        return mutated(whole, rng)
    return gzip.compress(mutated(gzip.decompress(whole), rng))


def limit():
    resource.setrlimit(resource.RLIMIT_AS, (MOST_ADDRESSES, MOST_ADDRESSES))
    resource.setrlimit(resource.RLIMIT_CPU, (MOST_CPU_S, MOST_CPU_S))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def observe(command, errors_file):
    """Exit code (negative: a signal), MB at most, seconds of CPU."""
    with open(errors_file, 'wb') as errors:
        child = subprocess.Popen([str(word) for word in command], stdout=subprocess.DEVNULL,
                                 stderr=errors, stdin=subprocess.DEVNULL, preexec_fn=limit)
        watch = threading.Timer(MOST_WALL_S, os.kill, (child.pid, signal.SIGKILL))
        watch.start()
        _, status, usage = os.wait4(child.pid, 0)
        watch.cancel()
    child.returncode = os.waitstatus_to_exitcode(status)
    return child.returncode, usage.ru_maxrss / 1024, usage.ru_utime + usage.ru_stime


def try_format(name, inputs, count):
    made = FORMATS[name](inputs)
    if made is None:
        print(f'{name:15} left out: its programs are not built')
        return []
    command, files = made
    errors = inputs.work / f'{name}.stderr'
    code, _, _ = observe(command, errors)
    if code not in (0, 1):
        raise Failure(f'{name}: the whole recording ends with {code}: {errors.read_text()}')
    codes, most_mb, most_s, failures = {}, 0., 0., []
    whole = {file: file.read_bytes() for file in files}
    for seed in range(count):
        rng = random.Random(f'{name} {seed}')
        file = rng.choice(files)
        file.write_bytes(mutated_file(whole[file], file.suffix, rng))
        code, mb, cpu_s = observe(command, errors)
        codes[code] = codes.get(code, 0) + 1
        most_mb, most_s = max(most_mb, mb), max(most_s, cpu_s)
        silent = code == 2 and not errors.read_bytes().strip()
        if code not in (0, 1, 2) or mb > MOST_MB or silent:
            kept = inputs.work / f'failed_{name}_{seed}{file.suffix}'
            shutil.copy(file, kept)
            failures.append(f'{name} {seed}: exit {code}, {mb:.0f} MB, {cpu_s:.1f} s: {kept}')
        file.write_bytes(whole[file])
    said = ', '.join(f'{code}: {n}' for code, n in sorted(codes.items()))
    print(f'{name:15} {count} mutations; exit codes {said}; at most {most_mb:.0f} MB, '
          f'{most_s:.1f} s of CPU', flush=True)
    return failures


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('bin', type=pathlib.Path)
    parser.add_argument('source', type=pathlib.Path)
    parser.add_argument('work', type=pathlib.Path)
    parser.add_argument('--count', type=int, default=200)
    parser.add_argument('--formats', default=','.join(FORMATS))
    arguments = parser.parse_args()
    inputs = Inputs(*(path.resolve() for path in (arguments.bin, arguments.source, arguments.work)))
    failures = []
    for name in arguments.formats.split(','):
        failures += try_format(name, inputs, arguments.count)
    for failure in failures:
        print(failure)
    return 1 if failures else 0


if __name__ == '__main__':
    sys.exit(main())
