"""The JSON Schema of run configurations, by an independent validator: it accepts what is delivered,
and refuses what the program refuses.  test_schema.py VIWO CONFIGS"""
import copy
import json
import pathlib
import re
import subprocess
import sys
import unittest

try:
    import jsonschema
    import yaml
except ImportError as error:
    print(f'skipped: {error}; scripts/install_dependencies.sh --tests installs it for '
          '/usr/bin/python3')
    sys.exit(77)

VIWO, CONFIGS = sys.argv[1], pathlib.Path(sys.argv[2])


class Loader(yaml.SafeLoader):
    """YAML 1.2 as editors read it: 1e-4 is a number."""


Loader.add_implicit_resolver(
    'tag:yaml.org,2002:float',
    re.compile(r'^[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?$'), list('-+0123456789.'))


def read(file):
    return yaml.load(file.read_text(), Loader)


class Schema(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        schema = json.loads(subprocess.check_output([VIWO, 'plugins', 'schema']))
        cls.validator = jsonschema.validators.validator_for(schema)(schema)
        cls.validator.check_schema(schema)
        cls.swerve = read(CONFIGS / 'runs/viwo_swerve.yaml')

    def errors(self, run):
        return ['/'.join(map(str, e.absolute_path)) + ': ' + e.message
                for e in self.validator.iter_errors(run)]

    def changed(self, path, value):
        run = copy.deepcopy(self.swerve)
        *parents, key = path.split('/')
        section = run
        for parent in parents:
            section = section[parent]
        section[key] = value
        return run

    def test_accepts_the_delivered_runs(self):
        files = sorted((CONFIGS / 'runs').glob('*.yaml'))
        self.assertGreater(len(files), 15)
        for file in files:
            with self.subTest(file.name):
                self.assertEqual(self.errors(read(file)), [])

    def test_refuses_what_the_program_refuses(self):
        sensor = next(iter(self.swerve['sensors']))
        for path, value in [
                ('estimator/clone', 11), ('estimator/clones', 1), ('estimator/clones', 2.5),
                ('estimator/restart', 'sometimes'), ('imu/range_gyro_rad_per_s', 0),
                ('wheels/p_IinO_m', [1, 2]), ('wheels/hold_gauge', 'maybe'),
                ('kinematics/type', 'hovercraft'), ('kinematics/radius_m', -0.1),
                (f'sensors/{sensor}/motion', 'sideways'), (f'sensors/{sensor}/moton', 'straight'),
                ('updates/wheel_parity', {'find_nose': True}), ('updates/mine', {'type': 'none'}),
                ('gravity', 9.81)]:
            with self.subTest(path=path, value=value):
                self.assertNotEqual(self.errors(self.changed(path, value)), [])

    def test_tells_defaults_and_units(self):
        clones = self.validator.schema['properties']['estimator']['properties']['clones']
        self.assertEqual(clones['default'], 11)
        self.assertEqual(clones['anyOf'][0], {'type': 'integer', 'minimum': 2, 'maximum': 100})
        gravity = self.validator.schema['properties']['estimator']['properties'][
            'gravity_m_per_s2']
        self.assertIn('[m/s^2]', gravity['description'])


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1])
