#!/usr/bin/env python3
"""Packs the release archive: `tools/dist.py [--no-build] [--output DIR]`, or `just dist`.

    target/dist/fluxmorph-VERSION-TARGET.tar.gz          binary, README, licences, man pages, completions, Cargo.lock
    target/dist/fluxmorph-VERSION-TARGET.tar.gz.sha256

Needs nothing but cargo and Python's own library. The same sources, compiler and C compiler give the same archive: files
are sorted, and have the time of SOURCE_DATE_EPOCH or of the commit. At the end the archive is unpacked and tried.
Cargo.lock is the list of all packages with version and checksum, which auditing tools read.
"""

import argparse
import gzip
import hashlib
import io
import json
import os
import subprocess
import sys
import tarfile
import tempfile
from pathlib import Path

HOME = Path(__file__).resolve().parent.parent
# Largest binary [bytes]; it has 12.7 MB.
LARGEST_BINARY = 15_000_000
COPIED = ("README.md", "CHANGELOG.md", "LICENSE-MIT", "LICENSE-APACHE", "Cargo.lock")
SHELLS = {"bash": "fluxmorph.bash", "zsh": "_fluxmorph", "fish": "fluxmorph.fish", "powershell": "_fluxmorph.ps1",
          "elvish": "fluxmorph.elv"}
LICENCE_NAMES = ("LICENSE", "LICENCE", "COPYING", "COPYRIGHT", "NOTICE", "UNLICENSE", "AUTHORS")
THIRD_PARTY = """# Third-party software in the binary `fluxmorph`

The package `nlopt` holds NLopt, `metis-sys` holds METIS and GKlib (Apache-2.0). NLopt as a whole is under the GNU Lesser
General Public License, 2.1 or later, for the methods by L. Luksan (`lbfgs`, `tnewton` and `var2` of `optimizer.algorithm`).
The complete sources, from which the program can be built with a changed NLopt, are those of this repository and of the
packages below, each with the licence that it declares and the licence files in its source.

| package | version | licence | files |
|---|---|---|---|
"""


def output_of(*command, **options):
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, cwd=HOME, **options).stdout


def require(holds, message):
    if not holds:
        sys.exit(f"error: {message}")


def build():
    """The binary with profile `dist`; paths of this machine are no part of it."""
    home = Path(os.environ.get("CARGO_HOME") or Path.home() / ".cargo")
    flags = [f"--remap-path-prefix={HOME}=fluxmorph"]
    flags += [f"--remap-path-prefix={source}=registry" for source in sorted((home / "registry/src").glob("*"))]
    flags += os.environ.get("RUSTFLAGS", "").split()
    environment = {**os.environ, "CARGO_ENCODED_RUSTFLAGS": "\x1f".join(flags)}
    command = ["cargo", "build", "--locked", "--profile", "dist", "--bin", "fluxmorph"]
    subprocess.run(command, check=True, cwd=HOME, env=environment)


def foreign_packages(metadata):
    """The packages that the binary is built from, without those of this repository, by name and version."""
    tree = output_of("cargo", "tree", "--locked", "-e", "normal,build", "--prefix", "none", "-p", "fluxmorph",
                     "--format", "{p}").decode()
    wanted = {tuple(line.split()[:2]) for line in tree.splitlines() if line.strip()}
    packages = {(p["name"], f"v{p['version']}"): p for p in metadata["packages"]}
    return [packages[key] for key in sorted(wanted) if packages[key]["source"]]


def licence_files(package):
    """Licence files of a package, those of C libraries inside it included, sorted by path."""
    folder = Path(package["manifest_path"]).parent
    sources = (".RS", ".C", ".H", ".PY", ".TOML")
    found = [path for path in folder.rglob("*") if path.is_file() and path.name.upper().startswith(LICENCE_NAMES)]
    return [(path.relative_to(folder).as_posix(), path) for path in sorted(found)
            if not path.name.upper().endswith(sources)]


def third_party(packages):
    """Names, licences and licence texts of everything that is not of this repository; a text stands once."""
    lines, texts = [], {}
    for package in packages:
        names = []
        for name, path in licence_files(package):
            text = path.read_text(encoding="utf-8", errors="replace").replace("\r\n", "\n").strip()
            number, places = texts.setdefault(text, (len(texts) + 1, []))
            places.append(f"{package['name']} {package['version']}: {name}")
            names.append(f"{name} [{number}]")
        licence = (package["license"] or "NOASSERTION").replace(" / ", "/").replace("/", " OR ")
        files = ", ".join(names) or "none in the package"
        lines.append(f"| {package['name']} | {package['version']} | {licence} | {files} |")
    for text, (number, places) in texts.items():
        lines += ["", f"## [{number}] {'; '.join(places)}", "", "```text", text.replace("```", "'''"), "```"]
    return (THIRD_PARTY + "\n".join(lines) + "\n").encode()


def generated(binary):
    """Man pages, completions and schema, as the program writes them."""
    files = {f"share/completions/{name}": output_of(binary, "generate", "completions", shell)
             for shell, name in SHELLS.items()}
    files["share/fluxmorph.schema.json"] = output_of(binary, "generate", "schema")
    with tempfile.TemporaryDirectory() as folder:
        output_of(binary, "generate", "man", "--out", folder, stderr=subprocess.DEVNULL)
        return files | {f"share/man/man1/{page.name}": page.read_bytes() for page in Path(folder).glob("*.1")}


def archive(name, files, seconds):
    """A tar.gz whose bytes follow from the files alone."""
    packed = io.BytesIO()
    with gzip.GzipFile(filename="", mode="wb", fileobj=packed, mtime=seconds, compresslevel=9) as stream:
        with tarfile.open(fileobj=stream, mode="w", format=tarfile.USTAR_FORMAT) as tar:
            for path, content in sorted(files.items()):
                entry = tarfile.TarInfo(f"{name}/{path}")
                entry.size, entry.mtime = len(content), seconds
                entry.mode = 0o755 if path == "fluxmorph" else 0o644
                tar.addfile(entry, io.BytesIO(content))
    return packed.getvalue()


def try_out(packed, name, version):
    """Unpacks the archive beside its checksum and runs what is in it."""
    subprocess.run(["sha256sum", "--check", "--quiet", f"{packed.name}.sha256"], check=True, cwd=packed.parent)
    with tempfile.TemporaryDirectory() as folder:
        with tarfile.open(packed) as tar:
            tar.extractall(folder)
        binary = Path(folder, name, "fluxmorph")
        said = output_of(binary, "--version").decode().strip()
        require(said == f"fluxmorph {version}", f"`--version` prints {said!r}")
        checked = json.loads(output_of(binary, "check", HOME / "configs/shield_quick.toml", "--json"))
        require(checked, "`check` prints nothing")


def main():
    parser = argparse.ArgumentParser(description="Packs the release archive.")
    parser.add_argument("--no-build", action="store_true", help="take target/dist/fluxmorph as it is")
    parser.add_argument("--output", type=Path, help="folder of the archive [default: target/dist]")
    options = parser.parse_args()
    if not options.no_build:
        build()
    host = output_of("rustc", "--print", "host-tuple").decode().strip()
    metadata = json.loads(output_of("cargo", "metadata", "--locked", "--format-version", "1", "--filter-platform", host))
    binary = Path(metadata["target_directory"], "dist/fluxmorph")
    require(binary.is_file(), f"there is no {binary}; leave --no-build out")
    version = next(p["version"] for p in metadata["packages"] if p["name"] == "fluxmorph")
    seconds = int(os.environ.get("SOURCE_DATE_EPOCH") or output_of("git", "log", "-1", "--format=%ct"))
    packages = foreign_packages(metadata)
    files = {"fluxmorph": binary.read_bytes(), "THIRD-PARTY.md": third_party(packages)}
    size = len(files["fluxmorph"])
    require(size <= LARGEST_BINARY, f"the binary has {size} bytes, more than {LARGEST_BINARY}")
    files |= {name: (HOME / name).read_bytes() for name in COPIED} | generated(binary)
    name = f"fluxmorph-{version}-{host}"
    output = (options.output or binary.parent).resolve()
    output.mkdir(parents=True, exist_ok=True)
    packed = output / f"{name}.tar.gz"
    packed.write_bytes(archive(name, files, seconds))
    digest = hashlib.sha256(packed.read_bytes()).hexdigest()
    Path(f"{packed}.sha256").write_text(f"{digest}  {packed.name}\n", encoding="ascii")
    try_out(packed, name, version)
    print(f"{len(packages)} packages, {len(files)} files, {packed.stat().st_size} bytes, sha256 {digest}\n{packed}")


if __name__ == "__main__":
    main()
