#!/usr/bin/env python3
"""test_consumers.py SOURCE BUILD WORK CMAKE [CLASS...]: builds against the installation and runs.

Tutorial: every file and command of docs/writing_a_plugin.md, writing_an_update.md,
writing_a_state.md and writing_a_sensor.md. Skeletons: what `viwo plugins new` writes. Headers:
each compiles alone.
"""

import json
import pathlib
import re
import shutil
import statistics
import unittest

import tutorial
from installed import ConsumerTest, Installation


def expected_line(line):
    """A line of an output block as a pattern: runs of spaces are one, '...' is anything."""
    words = re.split(r'\s+', line.strip())
    return ' +'.join('.*' if word == '...' else re.escape(word) for word in words)


class FasterCopy(ConsumerTest):
    def test_the_program_goes_on_as_the_copy_for_this_processor(self):
        (self.folder / 'bin').mkdir()
        shutil.copy(Installation.prefix / 'bin/viwo', self.folder / 'bin')
        shutil.copytree(Installation.prefix / 'lib', self.folder / 'lib', symlinks=True)
        program = self.folder / 'bin/viwo'
        itself = self.run_command(program, '--version')
        self.assertRegex(itself, r'^viwo \d')
        expected = itself
        processor = pathlib.Path('/proc/cpuinfo').read_text(encoding='utf-8').split()
        for instructions, flags in (('x86-64-v3', ('avx2', 'fma', 'bmi2')),
                                    ('x86-64-v4', ('avx512bw', 'avx512dq', 'avx512vl'))):
            copy = self.folder / 'lib/viwo' / instructions / 'viwo'
            copy.parent.mkdir()
            copy.write_text('#!/bin/sh\necho "the copy of $0: $*"\n', encoding='utf-8')
            # As long as it is not a program, the one before does it.
            self.assertEqual(self.run_command(program, '--version'), expected)
            copy.chmod(0o755)
            if all(flag in processor for flag in flags):
                expected = f'the copy of {copy}: --version\n'
            self.assertEqual(self.run_command(program, '--version'), expected)
        self.assertEqual(self.run_command('env', 'VIWO_NO_FASTER_COPY=1', program, '--version'), itself)


class Tutorial(ConsumerTest):
    def follow(self, page):
        """Does what the page says; one shell for all of its commands."""
        path = Installation.source / 'docs' / page
        steps = tutorial.steps(path.read_text(encoding='utf-8'), page)
        self.assertTrue(steps, f'{page} has neither files nor commands')
        script, outputs = ['set -eu', f'cd "{self.folder}"'], []
        for step in steps:
            if step.kind == 'file':
                # Written by the script, at its place between the commands.
                content = self.folder / f'.block_{step.line}'
                content.write_text(step.text, encoding='utf-8')
                target = self.folder / step.name
                script.append(f'mkdir -p "{target.parent}" && cp "{content}" "{target}"')
            elif step.kind == 'commands':
                script += [f'echo "@{step.line}"', step.text]
            else:
                outputs.append(step)
        log = self.run_command('bash', '-c', '\n'.join(script))
        self.assertNotIn('warning:', log)
        for step in outputs:
            before = [match for match in re.finditer(r'^@(\d+)$', log, re.M)
                      if int(match[1]) < step.line][-1]
            printed = re.split(r'^@\d+$', log[before.end():], maxsplit=1, flags=re.M)[0]
            for line in step.text.splitlines():
                self.assertRegex(printed, '(?m)^' + expected_line(line) + r'\s*$',
                                 f'{page}:{step.line}')

    def test_writing_a_plugin(self):
        self.follow('writing_a_plugin.md')
        results = self.folder / 'tricycle' / 'results'
        with self.subTest('the run calibrates: from off by the prior to a tenth of it'):
            calibration = json.loads((results / 'run/summary.json').read_text())['calibration']
            for name, prior in (('r', 0.001), ('wheel_base', 0.01), ('delta_o', 0.01)):
                self.assertLess(calibration[name]['sigma'], 0.2 * prior, name)
                self.assertLess(abs(calibration[name]['error']), 4 * calibration[name]['sigma'],
                                name)
        with self.subTest('the comparison is what the page says'):
            variants = json.loads((results / 'compare/summary.json').read_text())['variants']
            self.assertEqual({name: (v['runs'], v['diverged'], v['failed'])
                              for name, v in variants.items()},
                             {name: (10, 0, 0)
                              for name in ('tricycle', 'tricycle_held', 'differential')})
            ate = {name: v['metrics']['ate_m']['mean'] for name, v in variants.items()}
            self.assertLess(abs(ate['tricycle'] - ate['differential']), 0.2 * ate['tricycle'])
            self.assertGreater(ate['tricycle_held'], 2 * ate['tricycle'])
            # Two-sided 99.9 % bounds of the mean over ten runs of a squared normal error.
            for name in ('r', 'wheel_base', 'delta_o'):
                nees = variants['tricycle']['calibration'][name]['nees']
                self.assertTrue(0.127 < nees < 3.14, f'{name}: {nees}')

    def test_a_page_with_code_that_nothing_checks_is_refused(self):
        with self.assertRaisesRegex(ValueError, 'page:3: a block that is neither a file'):
            tutorial.steps('Text.\n\n```cpp\nint x;\n```\n')
        with self.assertRaisesRegex(ValueError, 'page: 4 fences, but 1 blocks'):
            tutorial.steps('```sh\ntrue\n```\n\n  ```cpp\n  int x;\n  ```\n')

    def test_writing_an_update(self):
        self.follow('writing_an_update.md')

    def test_writing_a_state(self):
        self.follow('writing_a_state.md')
        summary = json.loads((self.folder / 'beacons/results/experiment/summary.json').read_text())
        variants = summary['variants']
        self.assertEqual({(v['runs'], v['diverged'], v['failed']) for v in variants.values()},
                         {(40, 0, 0)})

        def coordinates(name, axes):
            return [c for entry, c in variants[name]['calibration'].items()
                    if re.fullmatch(rf'beacon\d_[{axes}]', entry)]

        with self.subTest('the table of the page is what was measured'):
            page = (Installation.source / 'docs/writing_a_state.md').read_text(encoding='utf-8')
            for name, variant in variants.items():
                measured = [variant['metrics']['ate_m']['mean'], variant['nees_pose']]
                for found in (coordinates(name, 'xy'), coordinates(name, 'z')):
                    if not found:
                        continue
                    measured.append(statistics.mean(c['rmse'] ** 2 for c in found) ** 0.5)
                    measured.append(statistics.mean(c['nees'] for c in found))
                row = re.search(rf'^\| `{name}` \|(.*)$', page, re.M)[1].replace('0.3 m, held', '')
                printed = [float(number) for number in re.findall(r'\d+(?:\.\d+)?', row)]
                self.assertEqual(len(printed), len(measured), name)
                for number, value in zip(printed, measured):
                    # Two digits: rounding alone is up to a twentieth.
                    self.assertAlmostEqual(number, value, delta=0.05 * value, msg=name)
        # Two-sided 99.9 % bounds of the mean over 40 runs, of chi-square with 1 and with 6 degrees
        # of freedom; of the latter the mean over the time of a run varies less than one sample.
        worst = {name: max(c['nees'] for c in coordinates(name, 'xyz'))
                 for name in ('estimated', 'known_yaw', 'present_estimates')}
        with self.subTest('the filter knows how well it knows the beacons, and itself'):
            for name in ('estimated', 'known_yaw'):
                self.assertLess(worst[name], 1.902, name)
                self.assertGreater(min(c['nees'] for c in coordinates(name, 'xyz')), 0.423, name)
                self.assertTrue(4.36 < variants[name]['nees_pose'] < 7.97, name)
        with self.subTest('what is wrong on purpose is found to be wrong'):
            self.assertGreater(variants['as_surveyed']['nees_pose'], 7.97)
            self.assertGreater(worst['present_estimates'], 1.902)

    def test_writing_a_sensor(self):
        self.follow('writing_a_sensor.md')


class Skeletons(ConsumerTest):
    def write_and_try(self, kind):
        name = f'a_new_{kind}_2'
        printed = self.run_command('viwo', 'plugins', 'new', kind, name)
        self.assertEqual(printed, f'written: {name}; how to build and run it is in '
                                  f'{name}/README.md\n')
        for file in (self.folder / name).iterdir():
            text = file.read_text(encoding='utf-8')
            self.assertNotRegex(text, r'@\w+@', f'{file}: a placeholder was left')
        log = self.build_and_test(self.folder / name)
        for test in ('is_accepted', 'runs', 'conforms'):
            self.assertRegex(log, rf'Test +#\d: {test} \.+ +Passed')
        plugins = self.folder / name / 'build/lib/viwo/plugins/v11'
        listing = self.run_command('viwo', 'plugins', 'list', '--plugin-path', plugins)
        self.assertRegex(listing, rf'(?m)^{kind}  {name}  0\.1\.0  ')
        return self.folder / name

    def test_kinematics(self):
        folder = self.write_and_try('kinematics')
        with self.subTest('a plugin installs into a folder that viwo can be pointed to'):
            self.run_command(Installation.cmake, '--install', folder / 'build', '--prefix',
                             self.folder / 'mine')
            self.run_command('viwo', 'plugins', 'describe', 'a_new_kinematics_2', '--plugin-path',
                             self.folder / 'mine/lib/viwo/plugins/v11')

    def test_update(self):
        folder = self.write_and_try('update')
        summary = json.loads((folder / 'build/results/run/summary.json').read_text())
        self.assertGreater(summary['updates']['a_new_update_2']['applied'], 290)

    def test_sensor(self):
        folder = self.write_and_try('sensor')
        # 2 s straight on with 0.5 m/s, then 2 s with 0.4 rad/s (encoders.csv): yaw 0.8 rad, and
        # half a cell of the mean of both rates at the change.
        last = (folder / 'build/results/run/trajectory.tum').read_text().splitlines()[-1].split()
        self.assertAlmostEqual(float(last[6]), 0.3894, delta=0.01)


class RecordedLog(ConsumerTest):
    """A model that is not in the tree, on logs of a real robot, against the model of viwo."""

    def test_third_party_model(self):
        recordings = Installation.source.parent / 'shared/data/4wis4wid'
        if not recordings.is_dir():
            self.skipTest(f'no recordings in {recordings}')
        shutil.copytree(Installation.source / 'tests/install_consumer/swerve_auto',
                        self.folder / 'swerve_auto')
        build = self.folder / 'swerve_auto/build'
        self.run_command(Installation.cmake, '-S', 'swerve_auto', '-B', build)
        self.run_command(Installation.cmake, '--build', build)
        plugins = build / 'lib/viwo/plugins/v11'
        listing = self.run_command('viwo', 'plugins', 'list', '--plugin-path', plugins)
        self.assertRegex(listing, r'(?m)^kinematics  swerve_auto  1\.0\.0  ')
        conformance = self.folder / 'conformance.yaml'
        conformance.write_text('{type: swerve_auto, radius_m: 0.0254, track_m: 0.225}\n')
        self.run_command('viwo_conformance', plugins / 'libviwo_kinematics_swerve_auto.so',
                         '--config', conformance)
        experiment = self.folder / 'compare.yaml'
        experiment.write_text((self.folder / 'swerve_auto/compare.yaml').read_text().replace(
            '@SHARE@', str(Installation.prefix / 'share/viwo')))
        self.run_command('viwo', 'experiment', experiment, '--plugin-path', plugins, '--out',
                         'results', '--set', f'placeholders.data={recordings}')
        variants = json.loads((self.folder / 'results/summary.json').read_text())['variants']
        self.assertEqual([v['runs'] for v in variants.values()], [3, 3])
        # The same rows, derived and differentiated in another way: the same odometry.
        ate = {name: v['metrics']['ate_m']['mean'] for name, v in variants.items()}
        self.assertGreater(ate['viwo'], 0.001)
        self.assertAlmostEqual(ate['viwo'], ate['third_party'], delta=1e-9)


class Headers(ConsumerTest):
    def test_each_installed_header_compiles_alone(self):
        include = Installation.prefix / 'include'
        headers = sorted(str(path.relative_to(include)) for path in include.rglob('*.hpp'))
        self.assertIn('viwo/api/plugin.hpp', headers)
        self.assertIn('viwo/math/so3.hpp', headers)
        lines = ['cmake_minimum_required(VERSION 3.22)', 'project(headers LANGUAGES CXX)',
                 'find_package(viwo REQUIRED)', 'add_library(headers OBJECT)',
                 'target_link_libraries(headers PRIVATE viwo::api viwo::math)',
                 'target_compile_options(headers PRIVATE -Wall -Wextra -Wconversion -Wshadow '
                 '-Werror)']
        for header in headers:
            source = re.sub(r'\W', '_', header) + '.cpp'
            # Twice: a header must also bear to be included again.
            (self.folder / source).write_text(f'#include "{header}"\n#include "{header}"\n')
            lines.append(f'target_sources(headers PRIVATE {source})')
        (self.folder / 'CMakeLists.txt').write_text('\n'.join(lines) + '\n')
        self.run_command(Installation.cmake, '-S', '.', '-B', 'build', '-DCMAKE_BUILD_TYPE=Debug')
        self.run_command(Installation.cmake, '--build', 'build')


class Package(ConsumerTest):
    def test_other_versions_are_not_found(self):
        (self.folder / 'CMakeLists.txt').write_text(
            'cmake_minimum_required(VERSION 3.22)\nproject(p LANGUAGES CXX)\n'
            'find_package(viwo ${WANTED} REQUIRED)\n')
        self.run_command(Installation.cmake, '-S', '.', '-B', 'good', '-DWANTED=0.1')
        log = self.run_command(Installation.cmake, '-S', '.', '-B', 'bad', '-DWANTED=9.9', code=1)
        self.assertIn('compatible with requested version "9.9"', ' '.join(log.split()))

    def test_a_plugin_with_flags_of_its_own_is_refused_with_the_remedy(self):
        self.run_command('viwo', 'plugins', 'new', 'kinematics', 'fast')
        self.run_command(Installation.cmake, '-S', 'fast', '-B', 'fast/build',
                         '-DCMAKE_CXX_FLAGS=-ffast-math')
        self.run_command(Installation.cmake, '--build', 'fast/build')
        library = 'fast/build/lib/viwo/plugins/v11/libviwo_kinematics_fast.so'
        log = self.run_command('viwo', 'plugins', 'check', library, code=2)
        self.assertIn('fast_math: host 0, plugin 1\n  -> rebuild it without -ffast-math', log)

    def test_a_kind_that_does_not_exist_is_refused_by_cmake(self):
        (self.folder / 'CMakeLists.txt').write_text(
            'cmake_minimum_required(VERSION 3.22)\nproject(p LANGUAGES CXX)\n'
            'find_package(viwo REQUIRED)\nviwo_add_plugin(kinematic x SOURCES x.cpp)\n')
        log = self.run_command(Installation.cmake, '-S', '.', '-B', 'build', code=1)
        self.assertIn('the kind is kinematics, sensor or update', log)


if __name__ == '__main__':
    Installation.from_arguments()
    unittest.main()
