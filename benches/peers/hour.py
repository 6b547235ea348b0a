"""Runs the same hour in Vasos and in the peers that are installed, and prints what each took: see `run` beside it.

    python hour.py HOUR_PROGRAM [PEER ...]
"""

import importlib
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass

import solvers
from plant import Record, for_octave, iae_cm_s, read_hour, replay_error_cm, run_loop

ROOT = pathlib.Path(__file__).resolve().parents[2]
HERE = pathlib.Path(__file__).resolve().parent
# Each peer runs three times, and more often where that takes less than these seconds.
RUNS = 3
SPENT_S = 2.0
VASOS_RUNS = 50
WANTED_CM = 1e-6
# A peer that would need longer for the hour runs its first part, and the time is scaled.
LONGEST_S = 60.0
OCTAVE_TOLERANCE = 2e-9


@dataclass
class Row:
    name: str
    version: str
    how: str
    seconds: float
    processor_s: float
    error_cm: float
    sides: float | None
    iae_cm_s: float
    scaled_from: int | None = None


def run_vasos(program, folder):
    path = folder / "vasos.json"
    subprocess.run([program, str(VASOS_RUNS), path], check=True, stdout=subprocess.DEVNULL)
    return json.loads(path.read_text())


def samples_in_time(peer, hour):
    """How many samples to run: all, or a sixth of the hour where all would take too long."""
    trial = min(600, hour.samples)
    peer.run(trial)
    begun = time.perf_counter()
    peer.run(trial)
    whole_s = (time.perf_counter() - begun) * hour.samples / trial
    return hour.samples if whole_s < LONGEST_S else hour.step_samples


def best_of(work):
    """Least wall-clock and least processor time in seconds. The second does not count what else the computer does."""
    wall, processor, spent_s = [], [], 0.0
    while len(wall) < RUNS or spent_s < SPENT_S:
        begun = time.perf_counter(), time.process_time()
        work()
        wall.append(time.perf_counter() - begun[0])
        processor.append(time.process_time() - begun[1])
        spent_s += wall[-1]
    return min(wall), min(processor)


def run_peer(kind, hour):
    peer = kind(hour)
    samples = samples_in_time(peer, hour)
    best_s, processor_s = best_of(lambda: peer.run(samples))
    record = Record()
    peer.run(samples, record)
    scale = hour.samples / samples
    sides = peer.evaluations and peer.evaluations / samples
    return Row(
        peer.name, peer.version, peer.how, best_s * scale, processor_s * scale, replay_error_cm(hour, record), sides,
        iae_cm_s(hour, record) * scale, None if scale == 1 else samples,
    )  # fmt: skip


def run_octave(hour, folder):
    octave = shutil.which("octave-cli") or shutil.which("octave")
    if octave is None:
        raise ImportError("octave is not installed")
    given, found = folder / "hour.json", folder / "octave.json"
    given.write_text(for_octave(hour, tolerance=OCTAVE_TOLERANCE))
    command = [octave, "--quiet", "--no-init-file", HERE / "hour.m", given, str(RUNS), found]
    subprocess.run(command, check=True)
    out = json.loads(found.read_text())
    record = Record(out["inputs"], out["levels_cm"])
    how = "Adams; one call of `lsode` an interval"
    return Row(
        "Octave lsode", out["version"], how, out["seconds"], out["processor_s"], replay_error_cm(hour, record), None,
        iae_cm_s(hour, record),
    )  # fmt: skip


def milliseconds(seconds):
    return f"{1e3 * seconds:.1f} ms" if seconds < 0.1 else f"{1e3 * seconds:.0f} ms"


def table(rows):
    """Markdown; the first row is what the ratios refer to."""
    yield "| | version | how | 1 h | processor time | ratio of that | replay error | right-hand sides a sample |"
    yield "| --- | --- | --- | --- | --- | --- | --- | --- |"
    for row in rows:
        took = milliseconds(row.seconds)
        took += f" (from {row.scaled_from} samples)" if row.scaled_from else ""
        error = f"{row.error_cm:.1e} cm" + ("" if row.error_cm < WANTED_CM else ", misses 1e-6")
        sides = f"{row.sides:.1f}" if row.sides else ""
        ratio = row.processor_s / rows[0].processor_s
        ratio = f"{ratio:.1f}" if ratio < 10 else f"{ratio:.0f}"
        cells = [row.name, row.version, row.how, took, milliseconds(row.processor_s), ratio, error, sides]
        yield f"| {' | '.join(cells)} |"


def processor():
    try:
        lines = pathlib.Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return "processor unknown"


def load():
    return f"{os.getloadavg()[0]:.1f}"


def main(program, wanted):
    load_before = load()
    skipped = []
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        vasos = run_vasos(program, folder)
        hour = read_hour(ROOT / "assets/rigs/stad.toml", vasos)
        peers = [(kind.name, lambda kind=kind: run_peer(kind, hour)) for kind in solvers.PEERS]
        peers.append(("Octave lsode", lambda: run_octave(hour, folder)))
        rows = []
        for label, run in peers:
            if wanted and not any(word.lower() in label.lower() for word in wanted):
                continue
            print(f"{label} …", file=sys.stderr, flush=True)
            try:
                rows.append(run())
            except (ImportError, importlib.metadata.PackageNotFoundError) as reason:
                skipped.append(f"{label}: {reason}")
            except (RuntimeError, ArithmeticError, subprocess.CalledProcessError) as reason:
                skipped.append(f"{label} failed: {reason}")
        # Before and after the peers: the better of both, as for them.
        vasos["seconds"] = min(vasos["seconds"], run_vasos(program, folder)["seconds"])
    record = Record(vasos["inputs"], vasos["levels_cm"])
    # Of a hundred runs of a few milliseconds the best was not interrupted: its two times are the same.
    error_cm = replay_error_cm(hour, record)
    ours = Row(
        "**Vasos**", vasos["version"], "whole rig: four tanks, balance, all flows", vasos["seconds"], vasos["seconds"],
        error_cm, None, iae_cm_s(hour, record),
    )  # fmt: skip
    rows.sort(key=lambda row: row.seconds)
    print("\n".join(table([ours, *rows])))
    _, loop_s = best_of(lambda: run_loop(hour, lambda q: hour.start_cm, hour.samples))
    print(f"\nVasos: best of {2 * VASOS_RUNS}, {vasos['steps']} steps; the others best of {RUNS} or more.")
    print(f"Of every peer whose loop runs in plain Python, that loop takes {milliseconds(loop_s)} (not numba's, Octave's).")
    print(f"{processor()}, {os.cpu_count()} processors, load {load_before} before and {load()} after.")
    for line in skipped:
        print(f"skipped: {line}")
    # The noise differs, so the integral differs a little; a loop that does other work differs by more.
    odd = [row for row in rows if abs(row.iae_cm_s / ours.iae_cm_s - 1) > 0.02]
    for row in odd:
        print(f"{row.name}: IAE {row.iae_cm_s:.0f} cm s, Vasos {ours.iae_cm_s:.0f}: not the same hour", file=sys.stderr)
    return 1 if odd or any(row.error_cm >= WANTED_CM for row in [ours, *rows]) else 0


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    sys.exit(main(sys.argv[1], sys.argv[2:]))
