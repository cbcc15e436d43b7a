#!/usr/bin/env python3
"""Runs viwo and its peers on the same measurements, one after the other, and writes the table.

Called by ../compare_peers.sh, which builds what it needs; --help for the options. For every row a program
runs once per seed and round, in turn with the others, on one core (taskset). Times are CPU times of the
thread that estimates, per image epoch with its inertial measurements, as the programs write them: mean, 95th
percentile and largest, medians over the runs. Errors are those of `viwo evaluate --align none` for all of
them: RMSE over the way, means over the seeds. Allocations are counted in a run of their own, which is not
timed: those of a peer's epochs, and all of viwo's process. A run whose position is off by more than LOST of the
way and by more than LOST_M, or that ends with an error, is lost: it is counted, and in no mean.
"""

import argparse
import csv
import json
import os
import pathlib
import shutil
import statistics
import subprocess
import sys

LOST, LOST_M = 0.05, 1.
ROOT = pathlib.Path(__file__).resolve().parents[2]
NAMES = {'viwo': 'viwo', 'openvins': 'OpenVINS', 'sqrtvins': 'sqrtVINS'}

# What is set in a peer's own configuration of its own simulator. Their gates are at 95 %, times the multipliers;
# viwo's is set to that.
PEER_SETTINGS = {
    'verbosity': '"WARNING"', 'use_stereo': 'true', 'calib_imu_intrinsics': 'false', 'calib_imu_g_sensitivity': 'false',
    'max_msckf_in_update': 100, 'gravity_mag': 9.81, 'try_zupt': 'false',
    'record_timing_information': 'false', 'use_klt': 'true', 'use_aruco': 'false', 'use_mask': 'false',
    'fast_threshold': 20, 'grid_x': 5, 'grid_y': 5, 'min_px_dist': 10, 'downsample_cameras': 'false',
    'track_frequency': 31.0, 'num_opencv_threads': 0, 'up_msckf_sigma_px': 1, 'up_msckf_chi2_multipler': 1,
    'relative_config_imu': '"imu.yaml"', 'relative_config_imucam': '"cameras.yaml"', 'sim_do_perturbation': 'false',
    'sim_distance_threshold': 1.2, 'sim_freq_cam': 10, 'sim_freq_imu': 200, 'sim_min_feature_gen_dist': 5.0,
    'sim_max_feature_gen_dist': 7.0}
# An IMU without scales or misalignment, with the noises of openvins_sim.yaml and euroc.yaml.
PEER_IMU = """%YAML:1.0
imu0:
  accelerometer_noise_density: 2.0e-3
  accelerometer_random_walk: 3.0e-3
  gyroscope_noise_density: 1.6968e-4
  gyroscope_random_walk: 1.9393e-5
  rostopic: /imu0
  time_offset: 0.0
  update_rate: 200.0
  model: "kalibr"
  Tw: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
  R_IMUtoGYRO: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
  Ta: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
  R_IMUtoACC: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
  Tg: [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]
"""


class Row:
    """A line of the table: data of each seed, and what the estimators are told."""

    def __init__(self, name, data, cameras, *, rig='euroc', clones=11, landmarks=0, calibrate=False,
                 points=250, images=False, histogram='NONE'):
        self.name, self.data, self.cameras, self.rig = name, data, cameras, rig
        self.clones, self.landmarks, self.calibrate, self.points = clones, landmarks, calibrate, points
        self.images, self.histogram = images, histogram

    def write_peer_config(self, source, folder, seed=0):
        """What a peer is to be run with, as CONFIG of feed and export_openvins."""
        folder.mkdir(parents=True, exist_ok=True)
        config = folder / 'config.yaml'
        calibrate = 'true' if self.calibrate else 'false'
        settings = {
            **PEER_SETTINGS, 'max_cameras': self.cameras, 'max_clones': self.clones,
            'max_slam': self.landmarks, 'max_slam_in_update': self.landmarks,
            # Of all cameras together; started from the truth, a tracker keeps the number for initialising.
            'num_pts': self.points * (self.cameras if self.images else 1),
            'init_max_features': self.points * self.cameras,
            'calib_cam_extrinsics': calibrate, 'calib_cam_intrinsics': calibrate, 'calib_cam_timeoffset': calibrate,
            'histogram_method': f'"{self.histogram}"', 'sim_traj_path': f'"{source}/ov_data/sim/udel_gore.txt"',
            'sim_seed_state_init': seed, 'sim_seed_preturb': seed, 'sim_seed_measurements': seed}
        theirs = (source / 'config/rpng_sim/estimator_config.yaml').read_text().splitlines()
        kept = [line for line in theirs if line.partition(':')[0] not in settings]
        config.write_text('\n'.join(kept + [f'{key}: {value}' for key, value in settings.items()]) + '\n')
        (folder / 'imu.yaml').write_text(PEER_IMU)
        rig = (ROOT / 'configs/cameras' / f'{self.rig}.yaml').read_text()
        rig = rig.replace('camera_model', 'timeshift_cam_imu: 0.0\n  camera_model')
        (folder / 'cameras.yaml').write_text('%YAML:1.0\n' + rig)
        return config

    def viwo_command(self, viwo, data):
        """With the gate of the peers and their start."""
        rig = ROOT / 'configs/cameras' / f'{self.rig}.yaml'
        settings = [f'estimator.clones={self.clones}', f'updates.visual_features.max_landmarks={self.landmarks}',
                    'updates.visual_features.gate_probability=0.05',
                    f'cameras.kalibr={rig}', f'cameras.calibrate={"true" if self.calibrate else "false"}',
                    'cameras.sigma_position_m=0.015', 'cameras.relative=1']
        if not self.images:
            config = 'openvins_sim.yaml'
            settings += [f'placeholders.data={data.parent}', f'placeholders.rig={data.name}']
        else:
            config = 'euroc.yaml'
            settings += [f'placeholders.data={data.parent}', f'placeholders.sequence={data.name}',
                         f'sensors.tracks0.n_cameras={self.cameras}', f'sensors.tracks0.cameras={rig}',
                         f'sensors.tracks0.stereo={"true" if self.cameras == 2 else "false"}',
                         f'sensors.tracks0.num_pts={self.points}',
                         f'sensors.tracks0.histogram_method={self.histogram.lower()}',
                         'sensors.images0.cameras=[' + ','.join(f'cam{i}' for i in range(self.cameras)) + ']',
                         'estimator.start=reference', 'evaluation.alignment=none',
                         'estimator.gravity_m_per_s2=9.81']
            for key, sigma in (('orientation_rad', 0.017), ('position_m', 0.05), ('velocity_m_per_s', 0.01),
                               ('gyro_bias_rad_per_s', 0.02), ('accel_bias_m_per_s2', 0.02)):
                settings.append(f'estimator.sigma_start_{key}={sigma}')
        command = [viwo, 'run', ROOT / 'configs/runs' / config]
        for setting in settings:
            command += ['--set', setting]
        return command


class Lost(Exception):
    """A run that ended with an error."""


def run(command, environment=None, done=(0,)):
    """Runs to the end on one core; CPU time in seconds and largest memory in MB. Raises Lost."""
    pinned = ['taskset', '-c', '0'] if shutil.which('taskset') else []
    with subprocess.Popen([*pinned, *map(str, command)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          text=True, env={**os.environ, **(environment or {})}) as process:
        said = process.stdout.read()
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode not in done:
        raise Lost(f'{" ".join(map(str, command))}\nended with {process.returncode}:\n{said[-2000:]}')
    return {'cpu_s': usage.ru_utime + usage.ru_stime, 'rss_mb': usage.ru_maxrss / 1024}


def times_of(file):
    """Mean, 95th percentile and largest of the epochs' CPU times in ms."""
    with open(file, encoding='utf-8') as table:
        times = sorted(float(row['epoch_ms']) for row in csv.DictReader(table))
    return {'mean': statistics.fmean(times), 'p95': times[int(0.95 * (len(times) - 1))], 'max': times[-1]}


def errors_of(viwo, reference, estimate):
    """RMSE without alignment, and whether that is lost."""
    said = subprocess.run([viwo, 'evaluate', '--reference', reference, '--estimate', estimate, '--align', 'none'],
                          capture_output=True, text=True, check=False)
    if said.returncode != 0:
        sys.exit(f'viwo evaluate: {said.stderr}')
    found = json.loads(said.stdout)
    most_m = max(LOST * found['path_length_m'], LOST_M)
    return {'m': found['ate_m'], 'deg': found['ate_deg'], 'lost': found['ate_m'] > most_m}


class Programs:
    """What is compared, and how one of them is run on one set of data."""

    def __init__(self, arguments):
        self.viwo = arguments.viwo
        self.peers = {name: (feed, source) for name, (feed, source) in (
            ('openvins', arguments.openvins), ('sqrtvins', arguments.sqrtvins or (None, None))) if feed}
        self.names = ['viwo', *self.peers]
        self.preload = arguments.count
        self.work = arguments.work

    def run(self, name, row, data, count=False):
        """One run; what it took, and how far it is off."""
        out = self.work / 'runs' / f'{row.name.replace(" ", "_").replace(",", "")}_{name}'
        shutil.rmtree(out, ignore_errors=True)
        out.mkdir(parents=True)
        environment = {'OV_NO_RETRI': '1'}
        if count:
            environment |= {'LD_PRELOAD': str(self.preload), 'VIWO_COUNT_FILE': str(out / 'allocations.txt')}
        if name == 'viwo':
            # 1: the result is doubtful, and the table shows by how much.
            result = run(row.viwo_command(self.viwo, data) + ['--out', out / 'out'], environment, done=(0, 1))
            summary = json.loads((out / 'out/summary.json').read_text())
            result.update({key: summary['timing_ms']['total'][key] for key in ('mean', 'p95', 'max')})
            trajectory = out / 'out/trajectory.tum'
            result.update(nees=summary['accuracy']['nees_pose'], epochs=summary['epochs'])
            allocations = int((out / 'allocations.txt').read_text()) if count else None
        else:
            feed, source = self.peers[name]
            config = row.write_peer_config(source, out / 'config')
            result = run([feed, config, data, out], environment)
            report = json.loads((out / 'peer.json').read_text())
            result.update(times_of(out / 'timing.csv'))
            trajectory = out / 'trajectory.tum'
            result.update(nees=report['nees_pose'], epochs=report['epochs'])
            allocations = report['allocations']
        result.update(errors_of(self.viwo, data / 'reference.tum', trajectory))
        result['cpu_ms'] = result['cpu_s'] * 1e3 / result['epochs']
        if count:
            result['allocations'] = allocations / result['epochs']
        return result

    def compare(self, row, rounds):
        """Every program on every seed, in turn; medians of what is timed, means of what is estimated."""
        runs = {name: [] for name in self.names}
        lost = {name: set() for name in self.names}
        summary = {name: {} for name in self.names}
        for _ in range(rounds):
            for data in row.data:
                for name in self.names:
                    try:
                        result = self.run(name, row, data)
                    except Lost as error:
                        print(error, file=sys.stderr)
                        lost[name].add(data)
                        continue
                    if result['lost']:
                        lost[name].add(data)
                    else:
                        runs[name].append(result)
        for name, results in runs.items():
            summary[name]['lost'] = len(lost[name])
            if not results:
                continue
            for key in ('mean', 'p95', 'max', 'rss_mb', 'cpu_ms'):
                summary[name][key] = statistics.median(result[key] for result in results)
            for key in ('m', 'deg', 'nees'):
                summary[name][key] = statistics.fmean(result[key] for result in results)
            data = next(data for data in row.data if data not in lost[name])
            summary[name]['allocations'] = self.run(name, row, data, count=True)['allocations']
        return summary


def tabulate(rows, names):
    """Markdown: a line for each row and program."""
    lines = ['| (recordings) | | ms per epoch: mean, p95, max | ratio to OpenVINS | RMSE | pose NEES (6) | '
             'whole process: ms per epoch, MB | allocations per epoch |', '|---|---|---|---|---|---|---|---|']
    for row, results in rows:
        for name in names:
            result = results[name]
            line = f'| {row.name if name == names[0] else ""} ({len(row.data)}) | {NAMES[name]} | '
            lost = f' ({result["lost"]} lost)' if result['lost'] else ''
            if 'mean' not in result:
                lines.append(f'{line}all lost | | | | | |')
                continue
            # On images viwo's epochs are without its front end, which has a thread of its own.
            key = 'cpu_ms' if row.images else 'mean'
            times = '' if row.images else f'{result["mean"]:.3f}, {result["p95"]:.2f}, {result["max"]:.2f}'
            ratio = f'{result[key] / results["openvins"][key]:.3f}' if key in results['openvins'] else ''
            lines.append(
                f'{line}{times} | {ratio} | {result["deg"]:.3f} deg, {result["m"]:.4f} m{lost} | '
                f'{result["nees"]:.2f} | {result["cpu_ms"]:.2f}, {result["rss_mb"]:.0f} | '
                f'{result["allocations"]:.0f} |')
    return '\n'.join(lines)


def conditions(arguments):
    """What the figures depend on, in words."""
    processor = next((line.partition(':')[2].strip() for line in open('/proc/cpuinfo', encoding='utf-8')
                      if line.startswith('model name')), 'unknown processor')
    source = arguments.openvins[1]
    shown = any('OV_NO_RETRI' in file.read_text(errors='ignore')
                for file in pathlib.Path(source).glob('ov_msckf/src/core/*.cpp'))
    return (f'{processor}, one core. Simulated: {arguments.seeds} exports of OpenVINS\'s simulator, '
            f'{arguments.seconds:g} s at most, 10 Hz, no alignment; gates at 95 %, the same prior of the start, 11 clones '
            f'and no landmarks unless said, at most 100 points per update. {arguments.rounds} rounds. OpenVINS '
            f'{"without" if shown else "with"} the triangulation for its display. Lost: more than {LOST:.0%} of the '
            f'way and more than {LOST_M:g} m off, or ended with an error; such runs are in no mean.')


def write_reference(data):
    """The truth of a folder as TUM, for the evaluation of the peers."""
    euroc = data / 'mav0/state_groundtruth_estimate0/data.csv'
    with open(euroc if euroc.exists() else data / 'groundtruth.csv', encoding='utf-8') as table, \
            open(data / 'reference.tum', 'w', encoding='utf-8') as out:
        for row in list(csv.reader(table))[1:]:
            if euroc.exists():
                stamp, p, (w, *xyz) = f'{int(row[0]) // 10**9}.{int(row[0]) % 10**9:09d}', row[1:4], row[4:8]
                out.write(' '.join([stamp, *p, *xyz, w]) + '\n')
            else:
                out.write(' '.join([row[0], *row[5:8], *row[1:5]]) + '\n')


class Data:
    """Makes what the rows need, once, below the working folder."""

    def __init__(self, arguments):
        self.arguments, self.folder = arguments, arguments.work / 'data'

    @staticmethod
    def make(folder, settings, command):
        """Runs what writes a folder, unless it was written with these settings before."""
        done = folder / 'made_with.txt'
        wanted = '\n'.join(map(str, settings))
        if done.exists() and done.read_text() == wanted:
            return
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        run(command)
        write_reference(folder)
        done.write_text(wanted)

    def exports(self, cameras, points):
        """Of OpenVINS's simulator, a folder for each seed."""
        folders = []
        seconds = self.arguments.seconds
        for seed in range(1, self.arguments.seeds + 1):
            folder = self.folder / f'seed{seed}_{points}' / ('mono' if cameras == 1 else 'stereo')
            config = Row('export', [], cameras, points=points).write_peer_config(
                self.arguments.openvins[1], self.arguments.work / 'runs/export', seed)
            settings = [seconds, *(file.read_text() for file in sorted(config.parent.iterdir()))]
            self.make(folder, settings, [self.arguments.export, config, seconds, folder])
            folders.append(folder)
        return folders

    def rendered(self):
        """The robot of viwo_images.yaml, as a EuRoC folder."""
        folder = self.folder / 'rendered'
        seconds = min(self.arguments.seconds, 60)
        self.make(folder, [seconds], [
            self.arguments.viwo, 'simulate', ROOT / 'configs/runs/viwo_images.yaml', '--out', folder / 'mav0',
            '--set', f'sensors.simulator0.duration_s={seconds}'])
        return folder

    def real(self):
        """The user's EuRoC sequence, linked into a folder of our own."""
        folder = self.folder / 'euroc'
        folder.mkdir(parents=True, exist_ok=True)
        (folder / 'mav0').unlink(missing_ok=True)
        (folder / 'mav0').symlink_to(self.arguments.euroc.resolve() / 'mav0')
        write_reference(folder)
        return folder


def rows_of(arguments):
    """The lines of the table, each with its data made when it is its turn."""
    data = Data(arguments)
    for cameras, name in ((1, 'mono'), (2, 'stereo')):
        yield Row(name, data.exports(cameras, 250), cameras)
    for cameras, name in ((1, 'mono'), (2, 'stereo')):
        yield Row(f'{name}, 1000 points, 100 offered', data.exports(cameras, 1000)[:1], cameras, points=1000)
    for cameras, name in ((1, 'mono'), (2, 'stereo')):
        yield Row(f'{name}, cameras calibrated', data.exports(cameras, 250), cameras, calibrate=True)
    for landmarks in (25, 50):
        for cameras, name in ((1, 'mono'), (2, 'stereo')):
            yield Row(f'{name}, {landmarks} landmarks', data.exports(cameras, 250), cameras, landmarks=landmarks)
    for cameras, name in ((1, 'mono'), (2, 'stereo')):
        yield Row(f'{name}, 30 clones', data.exports(cameras, 250)[:1], cameras, clones=30)
    if not arguments.no_images:
        yield Row('rendered images, stereo', [data.rendered()], 2, rig='t265_like', images=True, points=200)
    if arguments.euroc:
        for cameras, name in ((1, 'mono'), (2, 'stereo')):
            yield Row(f'EuRoC images, {name}', [data.real()], cameras, images=True, points=200,
                      histogram='HISTOGRAM')


def main():
    parser = argparse.ArgumentParser(description=__doc__.split('\n', 1)[0])
    parser.add_argument('--viwo', type=pathlib.Path, required=True)
    parser.add_argument('--openvins', type=pathlib.Path, nargs=2, required=True, metavar=('FEED', 'SOURCE'))
    parser.add_argument('--sqrtvins', type=pathlib.Path, nargs=2, metavar=('FEED', 'SOURCE'))
    parser.add_argument('--export', type=pathlib.Path, required=True, help='export_openvins')
    parser.add_argument('--count', type=pathlib.Path, required=True, help='libcount_allocations.so')
    parser.add_argument('--work', type=pathlib.Path, required=True)
    parser.add_argument('--euroc', type=pathlib.Path, help='folder that holds mav0')
    parser.add_argument('--seeds', type=int, default=10, help='exports of the simulator')
    parser.add_argument('--rounds', type=int, default=3, help='of every run, in turn')
    parser.add_argument('--seconds', type=float, default=120, help='of an export')
    parser.add_argument('--rows', default='', help='only rows whose name contains this')
    parser.add_argument('--no-images', action='store_true')
    arguments = parser.parse_args()

    programs = Programs(arguments)
    done = []
    for row in rows_of(arguments):
        if arguments.rows not in row.name:
            continue
        print(f'{row.name}: {len(row.data)} recordings, {arguments.rounds} rounds', file=sys.stderr)
        done.append((row, programs.compare(row, arguments.rounds)))
        (arguments.work / 'table.md').write_text(f'{tabulate(done, programs.names)}\n\n{conditions(arguments)}\n')
        (arguments.work / 'table.json').write_text(json.dumps({row.name: found for row, found in done}, indent=1))
    print(f'{tabulate(done, programs.names)}\n\n{conditions(arguments)}')


if __name__ == '__main__':
    main()
