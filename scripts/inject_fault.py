#!/usr/bin/env python3
"""Puts one fault into a log folder, as sensors, mountings and buses make them.

    inject_fault.py list
    inject_fault.py FAULT LOG OUT [--seed N] [--at S]

LOG is a log folder (imu0, wheels0 and features0, each with data.csv or data.csv.gz), as `viwo
simulate` writes it. OUT, which must not exist, gets the table with the fault and links to the
others. Faults that begin do so `--at` seconds after the first row, in the middle if not given. The
same arguments give the same bytes.

What a run on OUT must be is the second word of `list`:
    accurate    nearly as accurate as on LOG
    flagged     diverged, failed or doubtful, or it warns of the sensor
    either      one of the two
    told        flagged, or refused with the reason: a part of the log cannot be used
"""
import argparse
import dataclasses
import gzip
import math
import pathlib
import random
import sys
from typing import Callable

from fault_parts import (
    ACCEL, afterwards, anywhere, both, cameras_exchanged, clipped, cut_off, dark, DRIVE, during,
    exchanged, exchanged_ids, field, frozen, gone, GYRO, in_bursts, jittered, later,
    letter, now_and_then, numbers, one_stamp, out_of_order, plus, plus_or_minus, points,
    repeated, sometimes, spoilt, stamps, STEER, stuck, swinging, Table, text, times, twice)

DEG = 180 / math.pi
IMU, WHEELS, CAMERA = 'imu0', 'wheels0', 'features0'
ACCURATE, FLAGGED, EITHER, TOLD = 'accurate', 'flagged', 'either', 'told'


@dataclasses.dataclass
class Fault:
    table: str
    must: str
    what: str
    put: Callable  # changes a Table; what it returns, if anything, is the text of the file
    one_row: bool = False


WRAP_S = 2**32 * 1e-6  # of a counter of microseconds with 32 bits

FAULTS = {
    # The IMU: gaps and ends
    'imu_gap_0.5s': Fault(IMU, ACCURATE, 'no samples for 0.5 s', gone(during(0.5))),
    'imu_gap_2s': Fault(IMU, EITHER, 'no samples for 2 s', gone(during(2))),
    'imu_gap_5s': Fault(IMU, EITHER, 'no samples for 5 s', gone(during(5))),
    'imu_losses': Fault(IMU, ACCURATE, '10 % of the samples lost', gone(sometimes(0.1))),
    'imu_ends': Fault(IMU, FLAGGED, 'no samples from there on', gone(afterwards)),
    # values
    'imu_spike': Fault(IMU, ACCURATE, 'one sample of 1000 m/s^2',
                       field(ACCEL, 0, text('1000')), True),
    'imu_spike_huge': Fault(IMU, ACCURATE, 'one sample of 1e20 m/s^2',
                            field(ACCEL, 1, text('1e20')), True),
    'imu_spike_in_range': Fault(IMU, ACCURATE, 'one sample of 150 m/s^2',
                                field(ACCEL, 0, text('150')), True),
    'imu_burst': Fault(IMU, EITHER, '5 % of the samples off by 50 m/s^2 and 5 rad/s', spoilt(0.05)),
    'imu_stuck_2s': Fault(IMU, EITHER, 'the same values for 2 s', stuck(during(2))),
    'imu_saturated': Fault(IMU, EITHER, 'gyro clipped at 0.3 rad/s, accelerometer at 10.2 m/s^2',
                           both(numbers(GYRO, clipped(0.3)), numbers(ACCEL, clipped(10.2)))),
    'imu_bias_jump': Fault(IMU, EITHER, 'gyro off by 0.02 rad/s, all axes, from there on',
                           numbers(GYRO, plus(0.02), afterwards)),
    # stamps
    'imu_stamp_future': Fault(IMU, ACCURATE, 'one stamp 1 h ahead', one_stamp(later(3600)), True),
    'imu_stamp_far_future': Fault(IMU, ACCURATE, 'one stamp of 4e18 ns',
                                  one_stamp(lambda stamp, table: 4 * 10**18), True),
    'imu_forward_1s': Fault(IMU, EITHER, 'all stamps from there on 1 s later',
                            stamps(later(1), afterwards)),
    'imu_back_1s': Fault(IMU, EITHER, 'all stamps from there on 1 s earlier',
                         stamps(later(-1), afterwards)),
    'imu_stamp_wraps': Fault(IMU, TOLD, 'counter of 2^32 us wraps: stamps 4295 s earlier',
                             stamps(later(-WRAP_S), afterwards)),
    'imu_latency': Fault(IMU, EITHER, 'held up for 0.1 s once a second, stamped on arrival',
                         in_bursts(0.1, 1)),
    # mounting and units
    'imu_axis_swapped': Fault(IMU, FLAGGED, 'x and y exchanged throughout',
                              both(exchanged(GYRO, 0, 1), exchanged(ACCEL, 0, 1))),
    'imu_upside_down': Fault(IMU, FLAGGED, 'y and z reversed throughout', both(
        *(numbers(name, times(-1), which=i) for name in (GYRO, ACCEL) for i in (1, 2)))),
    'imu_gyro_reversed': Fault(IMU, FLAGGED, 'z of the gyro reversed throughout',
                               numbers(GYRO, times(-1), which=2)),
    'imu_in_deg': Fault(IMU, FLAGGED, 'gyro in deg/s throughout', numbers(GYRO, times(DEG))),
    'imu_in_g': Fault(IMU, FLAGGED, 'accelerometer in g throughout',
                      numbers(ACCEL, times(1 / 9.80665))),
    # rows
    'imu_bad_character': Fault(IMU, ACCURATE, 'one digit is a letter',
                               field(GYRO, 1, letter), True),
    'imu_nan': Fault(IMU, ACCURATE, 'one field is nan', field(ACCEL, 2, text('nan')), True),
    'imu_empty_field': Fault(IMU, ACCURATE, 'one field is empty', field(GYRO, 0, text('')), True),
    'imu_cut_off': Fault(IMU, ACCURATE, 'the last row is cut', cut_off, True),
    'imu_twice': Fault(IMU, ACCURATE, '1 % of the rows twice', twice(sometimes(0.01))),
    'imu_out_of_order': Fault(IMU, ACCURATE, 'two rows exchanged', out_of_order, True),
    'imu_block_twice': Fault(IMU, ACCURATE, 'the rows of 1 s twice', repeated(during(1))),
    # Wheels: what the floor and the drives do
    'wheel_slip_2s': Fault(WHEELS, ACCURATE, 'drive 1 turns twice as fast for 2 s',
                           numbers(DRIVE, times(2), during(2), 0)),
    'wheel_blocked_2s': Fault(WHEELS, ACCURATE, 'drive 2 stands still for 2 s',
                              numbers(DRIVE, times(0), during(2), 1)),
    'wheel_dead': Fault(WHEELS, ACCURATE, 'drive 3 reads 0 from there on',
                        numbers(DRIVE, times(0), afterwards, 2)),
    'wheel_spike': Fault(WHEELS, ACCURATE, 'one rate of 1e20 rad/s',
                         field(DRIVE, 0, text('1e20')), True),
    'wheel_outliers': Fault(WHEELS, ACCURATE, '1 % of the rates off by 5 rad/s',
                            numbers(DRIVE, now_and_then(0.01, plus_or_minus(5)))),
    'wheel_stuck_2s': Fault(WHEELS, EITHER, 'the same values for 2 s', stuck(during(2))),
    # gaps and stamps
    'wheel_gap_5s': Fault(WHEELS, ACCURATE, 'no samples for 5 s', gone(during(5))),
    'wheel_losses': Fault(WHEELS, ACCURATE, '20 % of the samples lost', gone(sometimes(0.2))),
    'wheel_ends': Fault(WHEELS, EITHER, 'no samples from there on', gone(afterwards)),
    'wheel_jitter': Fault(WHEELS, ACCURATE, 'stamps off by up to half a period, in order',
                          stamps(jittered)),
    'wheel_latency': Fault(WHEELS, EITHER, 'held up for 0.2 s once a second, stamped on arrival',
                           in_bursts(0.2, 1)),
    'wheel_stamp_future': Fault(WHEELS, ACCURATE, 'one stamp 1 h ahead',
                                one_stamp(later(3600)), True),
    'wheel_stamp_wraps': Fault(WHEELS, TOLD, 'counter of 2^32 us wraps: stamps 4295 s earlier',
                               stamps(later(-WRAP_S), afterwards)),
    'clock_wheels_50ms': Fault(WHEELS, EITHER, 'all stamps 50 ms later', stamps(later(0.05))),
    # mounting, wiring and units
    'wheel_swapped': Fault(WHEELS, FLAGGED, 'drives 1 and 3 exchanged throughout',
                           exchanged(DRIVE, 0, 2)),
    'wheel_reversed': Fault(WHEELS, FLAGGED, 'sign of drive 2 reversed throughout',
                            numbers(DRIVE, times(-1), which=1)),
    'wheels_reversed': Fault(WHEELS, FLAGGED, 'signs of all drives reversed throughout',
                             numbers(DRIVE, times(-1))),
    'drive_in_rpm': Fault(WHEELS, FLAGGED, 'drives in revolutions per minute throughout',
                          numbers(DRIVE, times(30 / math.pi))),
    'steer_jump': Fault(WHEELS, EITHER, 'steering angle 1 off by 0.2 rad from there on',
                        numbers(STEER, plus(0.2), afterwards, 0)),
    'steer_in_deg': Fault(WHEELS, FLAGGED, 'steering angles in degrees throughout',
                          numbers(STEER, times(DEG))),
    'steer_reversed': Fault(WHEELS, FLAGGED, 'signs of all steering angles reversed throughout',
                            numbers(STEER, times(-1))),
    # rows
    'wheel_bad_character': Fault(WHEELS, ACCURATE, 'one digit is a letter',
                                 field(DRIVE, 1, letter), True),
    'wheel_nan': Fault(WHEELS, ACCURATE, 'one field is nan', field(STEER, 2, text('nan')), True),
    'wheel_empty_field': Fault(WHEELS, ACCURATE, 'one field is empty',
                               field(DRIVE, 0, text('')), True),
    'wheel_cut_off': Fault(WHEELS, ACCURATE, 'the last row is cut', cut_off, True),
    'wheel_twice': Fault(WHEELS, ACCURATE, '1 % of the rows twice', twice(sometimes(0.01))),
    'wheel_out_of_order': Fault(WHEELS, ACCURATE, 'two rows exchanged', out_of_order, True),
    'wheel_block_twice': Fault(WHEELS, ACCURATE, 'the rows of 1 s twice', repeated(during(1))),
    # Cameras: what is seen
    'camera_dark_5s': Fault(CAMERA, ACCURATE, 'images without points for 5 s', dark(during(5))),
    'camera_gone_5s': Fault(CAMERA, ACCURATE, 'no images for 5 s', gone(during(5))),
    'camera_ends': Fault(CAMERA, EITHER, 'no images from there on', gone(afterwards)),
    'camera_frozen_2s': Fault(CAMERA, EITHER, 'the same points for 2 s', frozen(during(2))),
    'camera_outliers': Fault(CAMERA, ACCURATE, '30 % of the points anywhere in the image',
                             points(anywhere, sometimes(0.3))),
    'camera_shuffled_ids': Fault(CAMERA, ACCURATE, '10 % of the ids exchanged',
                                 exchanged_ids(0.1)),
    'camera_other_world': Fault(CAMERA, EITHER,
                                'half of the points swing by 15 px, as on something that moves',
                                points(swinging)),
    # stamps
    'clock_camera_8ms': Fault(CAMERA, ACCURATE, 'all stamps 8 ms later', stamps(later(0.008))),
    'clock_camera_20ms': Fault(CAMERA, ACCURATE, 'all stamps 20 ms later', stamps(later(0.02))),
    'camera_stamp_future': Fault(CAMERA, ACCURATE, 'one stamp 1 h ahead',
                                 one_stamp(later(3600)), True),
    # mounting and wiring
    'camera_swapped': Fault(CAMERA, FLAGGED, 'cameras 0 and 1 exchanged throughout',
                            cameras_exchanged),
    'camera_upside_down': Fault(CAMERA, FLAGGED, 'images turned by half a turn throughout', points(
        lambda u, v, table, row, width, height: (width - u, height - v))),
    # rows
    'camera_bad_character': Fault(CAMERA, ACCURATE, 'one digit is a letter',
                                  field('u [px]', 0, letter), True),
    'camera_nan': Fault(CAMERA, ACCURATE, 'one field is nan',
                        field('v [px]', 0, text('nan')), True),
    'camera_cut_off': Fault(CAMERA, ACCURATE, 'the last row is cut', cut_off, True),
}



def read(folder):
    plain, packed = folder / 'data.csv', folder / 'data.csv.gz'
    if plain.exists():
        return plain.read_text(encoding='utf-8')
    if packed.exists():
        return gzip.open(packed, 'rt', encoding='utf-8').read()
    return sys.exit(f'{folder}: neither data.csv nor data.csv.gz')


def inject(name, log, out, seed=1, at_s=None):
    """Writes `out`: the folder `log` with the fault `name`."""
    fault = FAULTS[name]
    table = Table(read(log / fault.table), at_s, random.Random(f'{name} {seed}'))
    text_of_file = fault.put(table) or table.text()
    (out / fault.table).mkdir(parents=True)
    (out / fault.table / 'data.csv').write_text(text_of_file, encoding='utf-8')
    for other in sorted(log.iterdir()):
        if other.name != fault.table:
            (out / other.name).symlink_to(other.resolve())


def main():
    if sys.argv[1:] == ['list']:
        for name, fault in FAULTS.items():
            print(f'{name:21} {fault.must:9} {fault.table:9} {fault.what}')
        return
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('fault', metavar='FAULT', choices=FAULTS)
    parser.add_argument('log', metavar='LOG', type=pathlib.Path)
    parser.add_argument('out', metavar='OUT', type=pathlib.Path)
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--at', type=float, metavar='S')
    options = parser.parse_args()
    if options.out.exists():
        sys.exit(f'{options.out} exists')
    inject(options.fault, options.log, options.out, options.seed, options.at)


if __name__ == '__main__':
    main()
