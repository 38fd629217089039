#!/usr/bin/env python3
"""The tables of docs/prove.md: crossings proved and found by a sweep; effort by number and size of uncertain numbers.

  prove_table.py [--program build/bin/tiltrim] [--boxes 20000] [--seconds 120] [--percent 5 10 15 20]
"""

import argparse
import json
import os
import signal
import subprocess
import tempfile
import time
from pathlib import Path

STUDIES = Path(__file__).resolve().parent.parent / "studies"
NUMBERS = ["aircraft.mass", "aircraft.inertia_yy", "aircraft.CM_de", "aircraft.air_density"]


def answer(program, command, study):
    """JSON of a command, which may end with a verdict that is no success."""
    run = subprocess.run([program, command, study, "-f", "json"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    return json.loads(run.stdout)


def crossings(program):
    """Each crossing of a sweep, and the undecided interval of the proof around it."""
    found = [c["at"]["h"] for c in answer(program, "sweep", STUDIES / "map_corridor.toml")["crossings"]]
    theorem = answer(program, "prove", STUDIES / "prove_reference.toml")["theorems"][0]
    open_ = [(r["from"]["h"], r["to"]["h"]) for r in theorem["regions"] if r["verdict"] == "undecided"]
    print("| crossing found by `sweep`, m | undecided by `prove`, m | its width, m |\n|---|---|---|")
    for h in found:
        inside = [f"{a:.10f} to {b:.10f} | {b - a:.1e}" for a, b in open_ if a <= h <= b]
        print(f"| {h:.10f} | {inside[0] if inside else 'elsewhere | '} |")
    print(f"\n{len(found)} crossings, {len(open_)} undecided intervals\n", flush=True)


def seconds_of(pid):
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def proof(options, keys, percent):
    """Theorem and processor time [s] of the scheduled gains with these numbers within so many percent."""
    study = (STUDIES / "prove_scatter.toml").read_text()
    study = study[: study.index('\n[[prove.parameter]]\nkey = "aircraft.mass"')]
    study += "".join(f'\n[[prove.parameter]]\nkey = "{key}"\npercent = {percent}\n' for key in keys)
    with tempfile.NamedTemporaryFile("w", suffix=".toml") as file, tempfile.TemporaryFile("w+") as out:
        file.write(study)
        file.flush()
        program = subprocess.Popen([options.program, "prove", file.name, "-f", "json", "--boxes", str(options.boxes)],
                                   stdout=out, stderr=subprocess.DEVNULL)
        while os.waitid(os.P_PID, program.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT) is None:
            time.sleep(0.05)
            if seconds_of(program.pid) > options.seconds:
                program.send_signal(signal.SIGINT)  # keeps what is proved
                break
        used = os.wait4(program.pid, 0)[2]
        out.seek(0)
        return json.load(out)["theorems"][0], used.ru_utime + used.ru_stime


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default="build/bin/tiltrim")
    parser.add_argument("--boxes", type=int, default=20000)
    parser.add_argument("--seconds", type=float, default=120, help="of processor time")
    parser.add_argument("--percent", type=float, nargs="+", default=[5, 10, 15, 20])
    options = parser.parse_args()
    crossings(options.program)
    print("| numbers | within | boxes | stable | unstable | no trim | undecided | CPU |\n|---|---|---|---|---|---|---|---|")
    for count in range(1, len(NUMBERS) + 1):
        for percent in options.percent:
            t, seconds = proof(options, NUMBERS[:count], percent)
            shares = " | ".join(f"{t[key]:.6f}" for key in
                                ("proved_stable", "proved_unstable", "proved_no_trim"))
            print(f"| {count} | {percent:g} % | {t['boxes']} | {shares} | {t['undecided']:.3g} | {seconds:.2f} s"
                  f"{' (stopped)' if t['interrupted'] else ''} |", flush=True)


if __name__ == "__main__":
    main()
