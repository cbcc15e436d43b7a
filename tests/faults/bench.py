"""Logs of the simulator, and what runs on them come to."""
import dataclasses
import json
import pathlib
import shutil
import subprocess
import sys

SWERVE = 'configs/runs/viwo_swerve.yaml'
LOG = 'configs/runs/viwo_log.yaml'


@dataclasses.dataclass
class Outcome:
    """A run: exit code, and what summary.json says of it (status 'refused' without one)."""
    code: int
    status: str
    ate_m: float = float('inf')
    duration_s: float = 0.
    texts: list = dataclasses.field(default_factory=list)  # cause and warnings
    warnings: list = dataclasses.field(default_factory=list)

    @property
    def ended_badly(self):
        return self.status in ('diverged', 'failed') or self.code == 1

    def is_accurate(self, clean, factor, more_m=0.):
        """As the run `clean`, to its end."""
        return (self.status == 'ok' and self.code == 0 and
                self.ate_m <= factor * clean.ate_m + more_m and
                self.duration_s >= 0.9 * clean.duration_s)


@dataclasses.dataclass
class Bench:
    viwo: pathlib.Path
    source: pathlib.Path
    work: pathlib.Path

    def simulate(self, seed, duration_s=30):
        """A log of the swerve robot with this seed; it is made once."""
        log = self.work / f'log_{seed}'
        if not log.exists():
            done = self.call('simulate', self.source / SWERVE, '--out', log, '--seed', seed,
                             '--set', f'sensors.simulator0.duration_s={duration_s}')
            if done.returncode != 0:
                sys.exit(f'{SWERVE} cannot be simulated: {done.stderr}')
        return log

    def run(self, name, log, seed, settings=()):
        """A run on the log; its folder is removed again."""
        out = self.work / f'run_{name}'
        shutil.rmtree(out, ignore_errors=True)
        words = [word for setting in settings for word in ('--set', setting)]
        done = self.call('run', self.source / LOG, '--out', out, '--seed', seed,
                         '--set', f'placeholders.log={log}', *words)
        if not (out / 'summary.json').exists():
            return Outcome(done.returncode, 'refused', texts=[done.stderr.strip()])
        summary = json.loads((out / 'summary.json').read_text(encoding='utf-8'))
        shutil.rmtree(out)
        cause = [summary['cause']] if summary['cause'] else []
        ate_m = summary['accuracy'].get('ate_m')
        warnings = summary['doubts'] + summary['warnings']
        return Outcome(done.returncode, summary['status'],
                       float('inf') if ate_m is None else ate_m, summary['duration_s'],
                       cause + warnings, warnings)

    def call(self, *words):
        return subprocess.run([str(word) for word in (self.viwo, *words)], text=True,
                              capture_output=True, check=False)
