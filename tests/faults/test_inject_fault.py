#!/usr/bin/env python3
"""test_inject_fault.py SOURCE: faults are in the log as they are described, and nowhere else."""
import pathlib
import random
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(sys.argv.pop(1)) / 'scripts'))
import inject_fault  # noqa: E402

MS = 10**6
HEADERS = {
    'imu0': '#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],'
            'a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]',
    'wheels0': 'timestamp_ns,drive_1 [rad/s],drive_2 [rad/s],drive_3 [rad/s],drive_4 [rad/s],'
               'steer_1 [rad],steer_2 [rad],steer_3 [rad],steer_4 [rad]',
    'features0': 'timestamp_ns,camera,id,u [px],v [px]'}


def small_log():
    """10 s: IMU at 100 Hz, wheels at 50 Hz, two cameras at 10 Hz with 40 points each."""
    rng = random.Random(7)
    rows = {name: [] for name in HEADERS}
    for name, step_ms, columns in (('imu0', 10, 6), ('wheels0', 20, 8)):
        for t in range(0, 10000, step_ms):
            values = [repr(rng.uniform(-12, 12)) for _ in range(columns)]
            rows[name].append(','.join([str(t * MS)] + values))
    for t in range(0, 10000, 100):
        for camera in range(2):
            rows['features0'] += [f'{t * MS},{camera},{i},{rng.uniform(0, 800)!r},'
                                  f'{rng.uniform(0, 600)!r}' for i in range(40)]
    return {name: '\n'.join([HEADERS[name]] + rows[name]) + '\n' for name in HEADERS}


class Faults(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.root = pathlib.Path(folder.name)
        cls.log = small_log()
        for name, text in cls.log.items():
            (cls.root / 'log' / name).mkdir(parents=True)
            (cls.root / 'log' / name / 'data.csv').write_text(text, encoding='utf-8')

    def inject(self, name, **options):
        """The table with the fault, as text."""
        out = pathlib.Path(tempfile.mkdtemp(dir=self.root)) / 'out'
        inject_fault.inject(name, self.root / 'log', out, **options)
        for table, text in self.log.items():
            if table != inject_fault.FAULTS[name].table:
                self.assertEqual((out / table / 'data.csv').read_text(encoding='utf-8'), text)
        return (out / inject_fault.FAULTS[name].table / 'data.csv').read_text(encoding='utf-8')

    def rows(self, name, **options):
        return [row.split(',') for row in self.inject(name, **options).splitlines()[1:]]

    def clean(self, table):
        return [row.split(',') for row in self.log[table].splitlines()[1:]]

    def test_each_changes_its_table_and_keeps_the_header(self):
        for name, fault in inject_fault.FAULTS.items():
            with self.subTest(name):
                text = self.inject(name)
                self.assertNotEqual(text, self.log[fault.table])
                self.assertEqual(text.splitlines()[0], HEADERS[fault.table])

    def test_the_same_arguments_give_the_same_bytes_and_another_seed_others(self):
        for name in inject_fault.FAULTS:
            with self.subTest(name):
                self.assertEqual(self.inject(name, seed=3), self.inject(name, seed=3))
        for name in ('imu_burst', 'imu_losses', 'wheel_outliers', 'wheel_jitter', 'camera_outliers',
                     'camera_shuffled_ids'):
            with self.subTest(name):
                self.assertNotEqual(self.inject(name, seed=3), self.inject(name, seed=4))

    def test_faults_of_one_row_leave_all_others(self):
        for name, fault in inject_fault.FAULTS.items():
            if not fault.one_row:
                continue
            with self.subTest(name):
                before, after = self.log[fault.table].splitlines(), self.inject(name).splitlines()
                self.assertEqual(len(before), len(after))
                changed = sum(a != b for a, b in zip(before, after))
                image = 2 * 40 if name == 'camera_stamp_future' else 1
                self.assertEqual(changed, 2 if 'order' in name else image)

    def test_a_gap_begins_where_it_is_put_and_has_its_length(self):
        stamps = [int(row[0]) for row in self.rows('imu_gap_2s', at_s=4)]
        gap = max(zip(stamps, stamps[1:]), key=lambda pair: pair[1] - pair[0])
        self.assertEqual(gap, (3990 * MS, 6000 * MS))

    def test_latency_keeps_the_order_and_lets_no_sample_come_early(self):
        before, after = self.clean('wheels0'), self.rows('wheel_latency')
        stamps = [int(row[0]) for row in after]
        self.assertTrue(all(a < b for a, b in zip(stamps, stamps[1:])))
        delays = [b - int(a[0]) for a, b in zip(before, stamps)]
        self.assertEqual(min(delays), 0)
        self.assertEqual(max(delays), 200 * MS)

    def test_shares_of_random_faults_are_those_described(self):
        # Binomial counts; four standard deviations.
        def bound(n, p):
            return 4 * (n * p * (1 - p)) ** 0.5
        for name, part in (('imu_burst', 0.05), ('wheel_outliers', 0.01), ('camera_outliers', 0.3)):
            with self.subTest(name):
                before, after = self.clean(inject_fault.FAULTS[name].table), self.rows(name)
                pairs = [(a, b) for x, y in zip(before, after) for a, b in zip(x, y)]
                per_row = {'imu_burst': 6, 'wheel_outliers': 1, 'camera_outliers': 2}[name]
                n = len(before) * (4 if name == 'wheel_outliers' else 1)
                changed = sum(a != b for a, b in pairs) / per_row
                self.assertLess(abs(changed - n * part), bound(n, part))

    def test_a_file_is_cut_within_its_last_row(self):
        text = self.inject('imu_cut_off')
        self.assertFalse(text.endswith('\n'))
        self.assertTrue(self.log['imu0'].startswith(text))
        self.assertEqual(text.count('\n'), self.log['imu0'].count('\n') - 1)

    def test_half_a_turn_of_images_twice_is_none(self):
        rows = self.rows('camera_upside_down')
        size = [max(float(row[i]) for row in self.clean('features0')) for i in (3, 4)]
        for before, after in zip(self.clean('features0'), rows):
            for i in (3, 4):
                self.assertAlmostEqual(float(before[i]) + float(after[i]), size[i - 3])


if __name__ == '__main__':
    unittest.main()
