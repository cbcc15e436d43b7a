#!/usr/bin/env python3
"""settings_table.py VIWO SOURCE WORK [--draws N]: runs on simulated logs with settings that are
wrong by what people get wrong, each with the run with right settings beside it.

A draw has one or several of:
    noises       of gyro, accelerometer (white and walk), drives, steering, sliding and pixels, each
                 times 0.1 .. 10, log-uniform
    extrinsics   of cameras and wheels: 3 deg about a random axis, 5 cm in a random direction
    radii        each wheel's within 5 %
    clocks       of cameras and wheels: 20 ms, early or late
    biases       gyro 1 deg/s and accelerometer 0.2 m/s^2 on each axis, of random sign, beside those
                 that the start knows: the zero-rate and zero-g limits of good MEMS data sheets
The first five draws have one kind each, the next five all but one, the eleventh all, the rest are
random. What runs may be: accurate (an ATE of at most three times that with right settings) or
flagged (diverged, failed, or with a warning). None silent.
"""
import argparse
import concurrent.futures
import math
import pathlib
import random
import re
import shutil
import sys

from bench import LOG, Bench

KINDS = ('noises', 'extrinsics', 'radii', 'clocks', 'biases')
LOGS = 3  # draw i is on log i modulo this
RAD = math.pi / 180
# The product's defaults for cameras, and nothing wrong but what is drawn here.
RIGHT = ('cameras.calibrate=true', 'estimator.calibration_error_scale=0')
CAMERAS = 'configs/cameras/t265_like.yaml'


def kinds_of(draw, rng):
    """Of draw 0, 1, ..."""
    if draw < 5:
        return [KINDS[draw]]
    if draw < 10:
        return [kind for kind in KINDS if kind != KINDS[draw - 5]]
    if draw == 10:
        return list(KINDS)
    return rng.sample(KINDS, rng.randint(1, len(KINDS)))


def direction(rng):
    v = [rng.gauss(0, 1) for _ in range(3)]
    length = math.sqrt(sum(x * x for x in v))
    return [x / length for x in v]


def rotation(axis, angle):
    """Rodrigues."""
    x, y, z = axis
    c, s = math.cos(angle), math.sin(angle)
    return [[c + x * x * (1 - c), x * y * (1 - c) - z * s, x * z * (1 - c) + y * s],
            [y * x * (1 - c) + z * s, c + y * y * (1 - c), y * z * (1 - c) - x * s],
            [z * x * (1 - c) - y * s, z * y * (1 - c) + x * s, c + z * z * (1 - c)]]


def value_of(source, key):
    """A number of the run configuration: what is drawn is relative to it."""
    text = (source / LOG).read_text(encoding='utf-8')
    return float(re.search(rf'\b{key}: ([-+.\de]+)', text)[1])


def noises(source, rng):
    keys = {'imu': ('sigma_gyro_rad_per_s_sqrt_hz', 'sigma_accel_m_per_s2_sqrt_hz',
                    'sigma_gyro_walk_rad_per_s2_sqrt_hz', 'sigma_accel_walk_m_per_s3_sqrt_hz'),
            'kinematics': ('sigma_drive_rad_per_s', 'sigma_steer_rad', 'sigma_lateral_m_per_s'),
            'updates.visual_features': ('sigma_px',)}
    return [f'{section}.{key}={value_of(source, key) * 10 ** rng.uniform(-1, 1):.6g}'
            for section, names in keys.items() for key in names]


def wheel_extrinsics(rng):
    p = [a + 0.05 * b for a, b in zip((0.05, 0.02, 0.15), direction(rng))]
    R = rotation(direction(rng), 3 * RAD)
    rpy = (math.atan2(R[2][1], R[2][2]), -math.asin(R[2][0]), math.atan2(R[1][0], R[0][0]))
    return [f'wheels.{key}=[{", ".join(f"{x:.9f}" for x in values)}]'
            for key, values in (('p_IinO_m', p), ('rpy_ItoO_rad', rpy))]


def turn_cameras(text, rng):
    """The Kalibr chain with each camera turned and moved."""
    def one(match):
        rows = [[float(x) for x in row.split(',')] for row in
                re.findall(r'- \[([^\]]*)\]', match[0])]
        R, offset = rotation(direction(rng), 3 * RAD), direction(rng)
        lines = ['T_cam_imu:']
        for i in range(3):
            turned = [sum(R[i][k] * rows[k][j] for k in range(3)) for j in range(4)]
            turned[3] += 0.05 * offset[i]
            lines.append(f'    - [{", ".join(f"{x:.12f}" for x in turned)}]')
        return '\n'.join(lines + ['    - [0.0, 0.0, 0.0, 1.0]'])
    return re.sub(r'T_cam_imu:(\s*- \[[^\]]*\]){4}', one, text)


def biased(log, out, rng):
    """The log with constants added to the IMU."""
    off = [rng.choice((-1, 1)) * x for x in 3 * [1 * RAD] + 3 * [0.2]]
    header, *rows = (log / 'imu0/data.csv').read_text(encoding='utf-8').splitlines()
    (out / 'imu0').mkdir(parents=True)
    lines = [header]
    for row in rows:
        stamp, *values = row.split(',')
        lines.append(','.join([stamp] + [repr(float(v) + o) for v, o in zip(values, off)]))
    (out / 'imu0/data.csv').write_text('\n'.join(lines) + '\n', encoding='utf-8')
    for other in log.iterdir():
        if other.name != 'imu0':
            (out / other.name).symlink_to(other.resolve())


def prepare(bench, draw):
    """(log, settings, kinds) of a draw; files it needs are in its folder."""
    rng = random.Random(draw)
    kinds = kinds_of(draw, rng)
    log, settings = bench.simulate(1 + draw % LOGS), list(RIGHT)
    folder = bench.work / f'draw_{draw}'
    folder.mkdir(exist_ok=True)
    chain = (bench.source / CAMERAS).read_text(encoding='utf-8')
    if 'noises' in kinds:
        settings += noises(bench.source, rng)
    if 'extrinsics' in kinds:
        settings += wheel_extrinsics(rng)
        chain = turn_cameras(chain, rng)
    if 'radii' in kinds:
        radii = [0.0255 * (1 + rng.uniform(-0.05, 0.05)) for _ in range(4)]
        settings.append(f'kinematics.radius_m=[{", ".join(f"{r:.6f}" for r in radii)}]')
    if 'clocks' in kinds:
        settings.append(f'wheels.t_OtoI_s={0.005 + rng.choice((-0.02, 0.02))}')
        shift = rng.choice((-0.02, 0.02))
        chain = re.sub(r'(camera_model: pinhole)', rf'\1\n  timeshift_cam_imu: {shift}', chain)
    if 'biases' in kinds:
        biased(log, folder / 'log', rng)
        log = folder / 'log'
    (folder / 'cameras.yaml').write_text(chain, encoding='utf-8')
    settings.append(f'cameras.kalibr={folder / "cameras.yaml"}')
    return log, settings, kinds


def one(bench, draw):
    log, settings, kinds = prepare(bench, draw)
    outcome = bench.run(f'draw_{draw}', log, 1 + draw % LOGS, settings)
    shutil.rmtree(bench.work / f'draw_{draw}')
    return kinds, outcome


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    for name in ('viwo', 'source', 'work'):
        parser.add_argument(name, type=pathlib.Path)
    parser.add_argument('--draws', type=int, default=30)
    options = parser.parse_args()
    shutil.rmtree(options.work, ignore_errors=True)
    options.work.mkdir(parents=True)
    bench = Bench(options.viwo.resolve(), options.source.resolve(), options.work.resolve())
    right = []
    for seed in range(1, LOGS + 1):
        right.append(bench.run(f'right_{seed}', bench.simulate(seed), seed, RIGHT))
        print(f'right settings, log {seed}: {right[-1].status}, ATE {1e3 * right[-1].ate_m:.2f} mm')
        if right[-1].code != 0 or right[-1].texts:
            print(f'  FALLS SHORT: {right[-1].texts}')
            return 1
    short = 0
    with concurrent.futures.ProcessPoolExecutor(2) as pool:
        runs = [pool.submit(one, bench, draw) for draw in range(options.draws)]
        for draw, run in enumerate(runs):
            kinds, outcome = run.result()
            clean = right[draw % LOGS]
            accurate = outcome.is_accurate(clean, 3)
            flagged = outcome.ended_badly or bool(outcome.warnings)
            words = [word for word, true in (('accurate', accurate), ('flagged', flagged)) if true]
            good = bool(words) and outcome.status != 'refused'
            short += not good
            print(f'draw {draw:2} ({", ".join(kinds)}): {"" if good else "FALLS SHORT "}'
                  f'{"+".join(words) or "SILENT"}, {outcome.status}, '
                  f'{outcome.ate_m / clean.ate_m:.1f} times\n    ' + ' | '.join(outcome.texts),
                  flush=True)
    shutil.rmtree(options.work)
    print(f'{options.draws} draws: {short} fall short')
    return 1 if short else 0


if __name__ == '__main__':
    sys.exit(main())
