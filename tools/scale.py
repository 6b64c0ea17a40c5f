#!/usr/bin/env python3
"""Memory, time and iterations of one harmonic field analysis on several ranks; prints the tables of docs/scale.md.

usage: tools/scale.py [--program FILE] [--mesh NAME ...] [--solver NAME ...] [--ranks N ...] [--keep FOLDER]

The program must be built with `--features petsc`. The problems are those of configs/shield.toml (a meshed plate at 60 Hz, with
skin layers a tenth of a millimetre thin) and of configs/shield_impedance.toml (the plate replaced by its surface), without
their designs, of a hundred thousand to a million tetrahedra. Every rank has one thread. Memory is the
largest that the process of a rank has held, set-up included.
"""
import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

# Configuration and settings of [mesh.shield]; numbers are tetrahedra.
MESHES = {
    "meshed 73k": ("shield", []),
    "meshed 103k": ("shield", ["refinement=1.3"]),
    "meshed 406k": ("shield", ["refinement=1.6"]),
    "meshed 1M": ("shield", ["refinement=2.5", "growth=2.1"]),
    "surface 148k": ("shield_impedance", ["refinement=1.6"]),
    "surface 569k": ("shield_impedance", ["refinement=2.6"]),
    "surface 1.2M": ("shield_impedance", ["refinement=3.5"]),
}

# Settings of [analysis.petsc].
SOLVERS = {
    "MUMPS": ["solver=mumps"],
    "ASM, GMRES": ["solver=asm"],
    "ASM, COCG": ["solver=asm", "krylov=cocg", "overlap=0"],
    "ASM, complete, GMRES": ["solver=asm", "sub_solver=complete"],
}
MEASURED = ["MUMPS", "ASM, GMRES"]

# Tables of a configuration that an analysis needs.
KEPT = ["mesh", "analysis", "materials", "regions", "coils", "boundaries"]


def configuration(name):
    """The text of a shipped configuration with the tables of the field problem alone."""
    text, keep = [], True
    for line in (ROOT / f"configs/{name}.toml").read_text().splitlines():
        if line.startswith("["):
            keep = line.strip("[").split("]")[0].split(".")[0] in KEPT
        if keep:
            text.append(line)
    return "\n".join(text) + '\n\n[output]\ndirectory = "run"\nfields = "none"\nreport = false\n'


def rank(record, command):
    """Runs a command as this rank, and writes what it has taken."""
    code = subprocess.run(command).returncode
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    taken = {"mib": used.ru_maxrss / 1024, "cpu": used.ru_utime + used.ru_stime}
    number = next((os.environ[name] for name in ("OMPI_COMM_WORLD_RANK", "PMI_RANK") if name in os.environ), "0")
    Path(f"{record}.{number}").write_text(json.dumps(taken))
    sys.exit(code)


def measure(program, folder, mesh, solver, ranks):
    """One analysis; what its ranks have taken and its result."""
    config, record = folder / "scale.toml", folder / "rank"
    name, mesh_settings = MESHES[mesh]
    config.write_text(configuration(name))
    for old in folder.glob("rank.*"):
        old.unlink()
    settings = [f"mesh.shield.{setting}" for setting in mesh_settings]
    settings += [f"analysis.petsc.{setting}" for setting in SOLVERS[solver]]
    command = ["mpirun", "--oversubscribe", "-n", str(ranks), sys.executable, __file__, "--rank", str(record), "--"]
    command += [str(program), "solve", str(config), "--out", str(folder / "run"), "--force", "--quiet", "--threads", "1"]
    for setting in settings:
        command += ["--set", setting]
    environment = dict(os.environ, OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")
    done = subprocess.run(command, env=environment, capture_output=True, text=True)
    if done.returncode != 0:
        said = [line for line in done.stderr.splitlines() if line.startswith("error")]
        return {"mesh": mesh, "solver": solver, "ranks": ranks, "failed": "; ".join(said) or done.stderr[-300:]}
    taken = [json.loads(path.read_text()) for path in sorted(folder.glob("rank.*"))]
    result = json.loads((folder / "run/result.json").read_text())
    return {
        "mesh": mesh,
        "solver": solver,
        "ranks": ranks,
        "tets": result["mesh"]["tets"],
        "unknowns": result["mesh"]["unknowns"],
        "iterations": result["linear_solver"]["iterations"],
        "residual": result["linear_solver"]["worst_residual"],
        "mib": [round(own["mib"]) for own in taken],
        "cpu": sum(own["cpu"] for own in taken),
        "seconds": {name: round(value, 2) for name, value in result["timings_s"].items()},
    }


def row(record):
    """A line of the table."""
    head = f"| {record['mesh']} | {record['solver']} | {record['ranks']} |"
    if "failed" in record:
        return f"{head} {record['failed']} | | | | |"
    factor, state = record["seconds"].get("factor", 0), record["seconds"].get("state", 0)
    return (
        f"{head} {record['unknowns']:,} | {record['iterations']} | {' + '.join(map(str, record['mib']))} | "
        f"{record['cpu']:.0f} | {factor:.1f} + {state:.1f} |"
    )


def main():
    if sys.argv[1:2] == ["--rank"]:
        rank(sys.argv[2], sys.argv[4:])
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", type=Path, default=ROOT / "target/release/fluxmorph")
    parser.add_argument("--mesh", action="append", choices=MESHES)
    parser.add_argument("--solver", action="append", choices=SOLVERS)
    parser.add_argument("--ranks", action="append", type=int)
    parser.add_argument("--keep", type=Path, help="folder for the records, a line of JSON each")
    arguments = parser.parse_args()
    print("| mesh | solver | ranks | unknowns | iterations | MiB of each rank | CPU [s] | factor + solve [s] |")
    print("|---|---|---|---|---|---|---|---|", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        for mesh in arguments.mesh or list(MESHES)[1:]:
            for solver in arguments.solver or MEASURED:
                for ranks in arguments.ranks or [1, 2]:
                    record = measure(arguments.program, Path(folder), mesh, solver, ranks)
                    print(row(record), flush=True)
                    if arguments.keep:
                        arguments.keep.mkdir(parents=True, exist_ok=True)
                        with open(arguments.keep / "scale.jsonl", "a") as lines:
                            lines.write(json.dumps(record) + "\n")


if __name__ == "__main__":
    main()
