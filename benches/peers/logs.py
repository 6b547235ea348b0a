"""Reads two logs of 10⁶ rows by 10 columns in Vasos, pandas and polars: see `run` beside it.

    python logs.py READ_LOG_PROGRAM

Each peer is told what Vasos finds out: separator, decimal mark, which column is the time and how it is written, which
words are missing values. polars has one thread here, as Vasos and pandas have.
"""

import importlib.metadata
import json
import pathlib
import subprocess
import sys
import tempfile
import time

RUNS = 5


def pandas_clean(path):
    import pandas

    return len(pandas.read_csv(path, engine="c"))


def pandas_messy(path):
    import pandas

    frame = pandas.read_csv(path, sep=";", decimal=",", na_values=["Bad"], engine="c")
    frame["time"] = pandas.to_datetime(frame["time"], format="%d.%m.%Y %H:%M:%S")
    return len(frame)


def polars_clean(path):
    import polars

    return polars.read_csv(path).height


def polars_messy(path):
    import polars

    frame = polars.read_csv(path, separator=";", decimal_comma=True, null_values=["Bad"], infer_schema_length=10000)
    return frame.with_columns(polars.col("time").str.to_datetime("%d.%m.%Y %H:%M:%S")).height


def best_of(work):
    best, rows = float("inf"), 0
    for _ in range(RUNS):
        begun = time.perf_counter()
        rows = work()
        best = min(best, time.perf_counter() - begun)
    return best, rows


def main(program):
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        subprocess.run([program, "write", folder], check=True)

        def vasos(path):
            out = folder / "out.json"
            subprocess.run([program, "read", path, str(RUNS), out], check=True, stdout=subprocess.DEVNULL)
            found = json.loads(out.read_text())
            return found["seconds"], found["rows"], found["version"]

        print("\n| | version | clean | ratio | messy | ratio |\n| --- | --- | --- | --- | --- | --- |")
        skipped, lines = [], []
        files = [folder / "clean.csv", folder / "messy.csv"]
        ours = [vasos(path) for path in files]
        for package, clean, messy in [("pandas", pandas_clean, pandas_messy), ("polars", polars_clean, polars_messy)]:
            try:
                version = importlib.metadata.version(package)
                found = [best_of(lambda w=w, p=p: w(p)) for w, p in zip((clean, messy), files)]
            except (ImportError, importlib.metadata.PackageNotFoundError) as reason:
                skipped.append(f"{package}: {reason}")
                continue
            assert all(rows == our[1] for (_, rows), our in zip(found, ours)), f"{package} reads other rows"
            lines.append((package, version, [s for s, _ in found]))
        # Before and after the peers: the better of both.
        again = [vasos(path) for path in files]
        best = [min(a[0], b[0]) for a, b in zip(ours, again)]
        print(f"| **Vasos** | {ours[0][2]} | {1e3 * best[0]:.0f} ms | 1 | {1e3 * best[1]:.0f} ms | 1 |")
        for package, version, s in lines:
            print(f"| {package} | {version} | {1e3 * s[0]:.0f} ms | {s[0] / best[0]:.2f} | {1e3 * s[1]:.0f} ms | {s[1] / best[1]:.2f} |")  # fmt: skip
        sizes = [path.stat().st_size / 1e6 for path in files]
        print(f"\n{ours[0][1]} rows of 10 columns, {sizes[0]:.0f} and {sizes[1]:.0f} MB; one thread each.")
        for line in skipped:
            print(f"skipped: {line}")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])
