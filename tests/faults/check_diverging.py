#!/usr/bin/env python3
"""check_diverging.py VIWO SOURCE WORK: docs/diverging.md quotes what viwo prints.

The rows of its tables begin with what is done, a fault of scripts/inject_fault.py or `--set
KEY=VALUE`, and quote lines of the output after it; '...' stands for anything.
"""
import concurrent.futures
import pathlib
import re
import shutil
import sys

from bench import LOG, Bench

PAGE = 'docs/diverging.md'
SEED = 1


def rows_of(page):
    """(line number, what is done, quoted lines)"""
    for number, line in enumerate(page.splitlines(), 1):
        cells = [cell.strip() for cell in re.split(r'(?<!\\)\|', line)]
        if len(cells) < 4 or not re.fullmatch('`[^`]+`', cells[1]):
            continue
        yield number, cells[1].strip('`'), re.findall('`([^`]+)`', cells[2])


def pattern(quoted):
    return '.*'.join(re.escape(part) for part in quoted.split('...'))


def printed_after(bench, done):
    """What the run prints, whatever its exit code."""
    import inject_fault
    log = bench.work / f'log_{SEED}'
    name = re.sub(r'\W', '_', done)
    settings = []
    if done.startswith('--set '):
        settings = done.split()
    else:
        inject_fault.inject(done, log, bench.work / f'fault_{name}')
        log = bench.work / f'fault_{name}'
    out = bench.work / f'run_{name}'
    run = bench.call('run', bench.source / LOG, '--out', out, '--set', f'placeholders.log={log}',
                     *settings)
    return run.stdout + run.stderr


def main():
    viwo, source, work = (pathlib.Path(word).resolve() for word in sys.argv[1:4])
    sys.path.insert(0, str(source / 'scripts'))
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    bench = Bench(viwo, source, work)
    rows = list(rows_of((source / PAGE).read_text(encoding='utf-8')))
    bench.simulate(SEED)
    errors = [] if rows else [f'{PAGE}: no rows']
    with concurrent.futures.ProcessPoolExecutor(2) as pool:
        runs = [pool.submit(printed_after, bench, done) for _, done, _ in rows]
        for (number, done, quoted), run in zip(rows, runs):
            printed = run.result()
            if not quoted:
                errors.append(f'{PAGE}:{number}: nothing is quoted')
            for text in quoted:
                if not re.search(pattern(text), printed):
                    errors.append(f'{PAGE}:{number}: {done} does not print "{text}", but\n'
                                  f'{printed}')
    shutil.rmtree(work)
    print('\n'.join(errors) or f'{len(rows)} rows are as printed')
    return 1 if errors else 0


if __name__ == '__main__':
    sys.exit(main())
