#!/usr/bin/env python3
"""fault_table.py VIWO SOURCE WORK [--seeds N] [--without-cameras] [--faults NAME,...]: the faults
of scripts/inject_fault.py in simulated logs of 30 s, and what runs on them come to.

accurate: status ok to the end of the log and an ATE of at most twice that of the clean log and
20 mm. flagged: diverged, failed or doubtful, or a warning that names the sensor with the fault. A run that is
neither is silent. A log is refused (exit code 2) only where the fault leaves no way to use it.
"""
import argparse
import concurrent.futures
import pathlib
import re
import shutil
import sys

from bench import Bench

# What warnings of a sensor begin with. What all updates contradict is the IMU's, or the wheels' where
# nothing else is measured.
NAMES = {'imu0': r'(the )?(all updates|imu|gyro|accel)', 'wheels0': r'(the )?(wheel|drive|steer)|'
         r'all updates .* measured by wheel_\w+(, wheel_\w+)*$',
         'features0': r'(the )?(visual|cam|image|feature)'}
WITHOUT_CAMERAS = ('updates.visual_features.enabled=false',)


def one(bench, name, seed, settings):
    """The outcome of one fault with one seed."""
    import inject_fault
    log = bench.work / f'fault_{name}_{seed}'
    shutil.rmtree(log, ignore_errors=True)
    inject_fault.inject(name, bench.simulate(seed), log, seed)
    outcome = bench.run(f'{name}_{seed}', log, seed, settings)
    shutil.rmtree(log)
    return outcome


def judge(fault, outcome, clean, must):
    """(what the run is, whether it may be that)"""
    if outcome.status == 'refused':
        return 'refused', must == 'told' and fault.table in ' '.join(outcome.texts)
    accurate = outcome.is_accurate(clean, 2, 0.02)
    warned = any(re.match(NAMES[fault.table], text, re.I) for text in outcome.warnings)
    flagged = outcome.ended_badly or warned
    words = [word for word, true in (('accurate', accurate), ('ended', outcome.ended_badly),
                                     ('warned', warned)) if true]
    fits = {'accurate': accurate, 'flagged': flagged, 'told': flagged,
            'either': accurate or flagged}[must]
    return '+'.join(words) or 'SILENT', fits


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    for name in ('viwo', 'source', 'work'):
        parser.add_argument(name, type=pathlib.Path)
    parser.add_argument('--seeds', type=int, default=3)
    parser.add_argument('--without-cameras', action='store_true')
    parser.add_argument('--faults', help='only these, separated by commas')
    options = parser.parse_args()
    sys.path.insert(0, str(options.source / 'scripts'))
    import inject_fault
    shutil.rmtree(options.work, ignore_errors=True)
    options.work.mkdir(parents=True)
    bench = Bench(options.viwo.resolve(), options.source.resolve(), options.work.resolve())
    settings = WITHOUT_CAMERAS if options.without_cameras else ()
    names = options.faults.split(',') if options.faults else list(inject_fault.FAULTS)
    seeds = range(1, options.seeds + 1)

    short = 0
    clean = {}
    for seed in seeds:
        clean[seed] = bench.run(f'clean_{seed}', bench.simulate(seed), seed, settings)
        print(f'clean, seed {seed}: {clean[seed].status}, ATE {1e3 * clean[seed].ate_m:.2f} mm')
        if clean[seed].code != 0 or clean[seed].texts:
            print(f'  FALLS SHORT: {clean[seed].texts}')
            short += 1
    with concurrent.futures.ProcessPoolExecutor(2) as pool:
        runs = {name: [pool.submit(one, bench, name, seed, settings)
                       for seed in seeds] for name in names}
        for name in names:
            fault = inject_fault.FAULTS[name]
            # What is not used must not be felt.
            unfelt = options.without_cameras and fault.table == 'features0'
            must = 'accurate' if unfelt else fault.must
            fits = True
            lines = []
            for seed, run in zip(seeds, runs[name]):
                outcome = run.result()
                word, good = judge(fault, outcome, clean[seed], must)
                fits = fits and good
                lines.append(f'    {"" if good else "FALLS SHORT "}seed {seed}: {word}, ATE '
                             f'{1e3 * outcome.ate_m:.4g} mm in {outcome.duration_s:.1f} s; ' +
                             ' | '.join(outcome.texts))
            short += not fits
            print(f'{name:21} must be {must:9} {"ok" if fits else "FALLS SHORT"} ({fault.what})')
            print('\n'.join(lines), flush=True)
    shutil.rmtree(options.work)
    print(f'{len(names)} faults, {options.seeds} seeds: {short} fall short')
    return 1 if short else 0


if __name__ == '__main__':
    sys.exit(main())
