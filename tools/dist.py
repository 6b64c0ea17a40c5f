#!/usr/bin/env python3
"""Packs the release archive: `tools/dist.py [--no-build] [--output DIR]`, or `just dist`.

    target/dist/fluxmorph-VERSION-TARGET.tar.gz          binary, README, licences, man page, completions, SBOM
    target/dist/fluxmorph-VERSION-TARGET.tar.gz.sha256

Needs nothing but cargo and Python's own library. The same sources, compiler and C compiler give the same archive: files
are sorted, and have the time of SOURCE_DATE_EPOCH or of the commit. At the end the archive is unpacked and tried.
"""

import argparse
import gzip
import hashlib
import io
import json
import os
import re
import subprocess
import sys
import tarfile
import tempfile
import time
import uuid
from pathlib import Path

HOME = Path(__file__).resolve().parent.parent
# Largest binary [bytes]; it has 12.7 MB.
LARGEST_BINARY = 15_000_000
# Longest start [s] of the fastest of 20 on a machine that does other things.
LONGEST_START = 0.020
SHELLS = {"bash": "fluxmorph.bash", "zsh": "_fluxmorph", "fish": "fluxmorph.fish", "powershell": "_fluxmorph.ps1",
          "elvish": "fluxmorph.elv"}
LICENCE_NAMES = ("LICENSE", "LICENCE", "COPYING", "COPYRIGHT", "NOTICE", "UNLICENSE", "AUTHORS")


def output_of(command, **options):
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, cwd=HOME, **options).stdout.decode()


def require(holds, message):
    if not holds:
        sys.exit(f"error: {message}")


def host():
    """The target that is built for."""
    return next(line.split()[1] for line in output_of(["rustc", "-vV"]).splitlines() if line.startswith("host:"))


def release_graph():
    """The packages that the binary is built from: metadata by (name, version), and the edges between them."""
    tree = output_of(["cargo", "tree", "--locked", "-e", "normal,build", "--prefix", "none", "-p", "fluxmorph",
                      "--format", "{p}"])
    wanted = {tuple(line.split()[:2]) for line in tree.splitlines() if line.strip()}
    wanted = {(name, version.removeprefix("v")) for name, version in wanted}
    command = ["cargo", "metadata", "--locked", "--format-version", "1", "--filter-platform", host()]
    metadata = json.loads(output_of(command))
    packages = {(p["name"], p["version"]): p for p in metadata["packages"]}
    missing = wanted - packages.keys()
    require(not missing, f"cargo metadata does not know {sorted(missing)}")
    key_of = {p["id"]: key for key, p in packages.items()}
    edges = {}
    for node in metadata["resolve"]["nodes"]:
        key = key_of[node["id"]]
        if key in wanted:
            normal = [d for d in node["deps"] if any(k["kind"] in (None, "build") for k in d["dep_kinds"])]
            edges[key] = sorted({key_of[d["pkg"]] for d in normal} & wanted)
    return {key: packages[key] for key in sorted(wanted)}, edges


def checksums():
    """SHA-256 of the packages from Cargo.lock."""
    sums, name, version = {}, None, None
    for line in (HOME / "Cargo.lock").read_text(encoding="utf-8").splitlines():
        found = re.fullmatch(r'(name|version|checksum) = "(.*)"', line)
        if not found:
            continue
        kind, value = found.groups()
        if kind == "name":
            name = value
        elif kind == "version":
            version = value
        else:
            sums[name, version] = value
    return sums


def expression(package):
    """SPDX expression; old manifests part alternatives by a slash."""
    text = package["license"] or "NOASSERTION"
    return re.sub(r"\s*/\s*", " OR ", text)


def purl(key):
    return f"pkg:cargo/{key[0]}@{key[1]}"


def licence_files(package):
    """Licence files of a package, those of C libraries inside it included, sorted by path."""
    folder = Path(package["manifest_path"]).parent
    if folder == HOME or HOME / "crates" in folder.parents:
        return []
    found = []
    for place, folders, names in os.walk(folder):
        folders.sort()
        for name in sorted(names):
            stem = name.upper()
            if stem.startswith(LICENCE_NAMES) and not stem.endswith((".RS", ".C", ".H", ".PY", ".TOML")):
                found.append(Path(place, name))
    return [(path.relative_to(folder).as_posix(), path) for path in found]


def c_libraries(packages):
    """C libraries inside packages that are linked: (name, version, licence, package)."""
    libraries = []
    for key, package in packages.items():
        folder = Path(package["manifest_path"]).parent
        if key[0] == "nlopt":
            for inner in sorted(folder.glob("nlopt-*")):
                libraries.append(("nlopt", inner.name.removeprefix("nlopt-"), "MIT AND LGPL-2.1-or-later", key))
        if key[0] == "metis-sys":
            header = (folder / "vendor/metis/include/metis.h").read_text(encoding="utf-8", errors="replace")
            parts = [re.search(rf"#define METIS_VER_{part}\s+(\d+)", header) for part in ("MAJOR", "MINOR", "SUBMINOR")]
            require(all(parts), "metis.h does not say its version")
            libraries.append(("metis", ".".join(p.group(1) for p in parts), "Apache-2.0", key))
            libraries.append(("gklib", "bundled", "Apache-2.0", key))
    return libraries


def sbom(packages, edges, libraries, seconds):
    """A CycloneDX 1.5 document, sorted, without anything of this machine."""
    sums = checksums()
    version = next(p["version"] for (name, _), p in packages.items() if name == "fluxmorph")
    components = []
    for key, package in packages.items():
        component = {"type": "library", "bom-ref": purl(key), "name": key[0], "version": key[1],
                     "purl": purl(key), "licenses": [{"expression": expression(package)}]}
        if key in sums:
            component["hashes"] = [{"alg": "SHA-256", "content": sums[key]}]
        if key[0] != "fluxmorph":
            components.append(component)
    for name, number, licence, owner in libraries:
        reference = f"pkg:generic/{name}@{number}"
        components.append({"type": "library", "bom-ref": reference, "name": name, "version": number,
                           "purl": reference, "licenses": [{"expression": licence}]})
    dependencies = []
    for key in packages:
        inner = [f"pkg:generic/{name}@{number}" for name, number, _, owner in libraries if owner == key]
        dependencies.append({"ref": purl(key), "dependsOn": [purl(other) for other in edges.get(key, [])] + inner})
    root = {"type": "application", "bom-ref": f"pkg:cargo/fluxmorph@{version}", "name": "fluxmorph",
            "version": version, "purl": f"pkg:cargo/fluxmorph@{version}",
            "licenses": [{"expression": "MIT OR Apache-2.0"}]}
    content = {"bomFormat": "CycloneDX", "specVersion": "1.5", "version": 1,
               "metadata": {"timestamp": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime(seconds)), "component": root},
               "components": components, "dependencies": dependencies}
    # The serial number follows from the content, so that the same content has the same one.
    digest = hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
    serial = uuid.uuid5(uuid.NAMESPACE_URL, f"fluxmorph-sbom:{digest}")
    content = {"bomFormat": "CycloneDX", "specVersion": "1.5", "serialNumber": f"urn:uuid:{serial}", **content}
    return json.dumps(content, indent=2) + "\n"


def third_party(packages, libraries):
    """Names, licences and licence texts of everything that is not of this repository; a text stands once."""
    foreign = {key: p for key, p in packages.items() if p["source"]}
    lines = ["# Third-party software in the binary `fluxmorph`", "",
             "Rust packages, with the licence that each declares and the licence files in its source.", "",
             "| package | version | licence | files |", "|---|---|---|---|"]
    texts = {}
    for key, package in foreign.items():
        names = []
        for name, path in licence_files(package):
            text = path.read_text(encoding="utf-8", errors="replace").replace("\r\n", "\n").strip()
            number = texts.setdefault(text, (len(texts) + 1, []))
            number[1].append(f"{key[0]} {key[1]}: {name}")
            names.append(f"{name} [{number[0]}]")
        lines.append(f"| {key[0]} | {key[1]} | {expression(package)} | {', '.join(names) or 'none in the package'} |")
    lines += ["", "C libraries inside of packages:", "", "| library | version | licence | package |",
              "|---|---|---|---|"]
    for name, number, licence, owner in libraries:
        lines.append(f"| {name} | {number} | {licence} | {owner[0]} {owner[1]} |")
    lines += ["", "NLopt as a whole is under the GNU Lesser General Public License, 2.1 or later, for the methods by "
              "L. Luksan (`lbfgs`, `tnewton` and `var2` of `optimizer.algorithm`). The complete sources, from which the "
              "program can be built with a changed NLopt, are those of this repository and of the packages above.", ""]
    for text, (number, places) in texts.items():
        lines += [f"## [{number}] {'; '.join(places)}", "", "```text", text.replace("```", "'''"), "```", ""]
    return "\n".join(lines)


def commit_time():
    given = os.environ.get("SOURCE_DATE_EPOCH")
    return int(given) if given else int(output_of(["git", "log", "-1", "--format=%ct"]).strip())


def build():
    """The binary with profile `dist`; paths of this machine are no part of it."""
    home = Path(os.environ.get("CARGO_HOME") or Path.home() / ".cargo")
    sources = sorted((home / "registry/src").glob("*")) or [home / "registry/src"]
    flags = [f"--remap-path-prefix={HOME}=fluxmorph"]
    flags += [f"--remap-path-prefix={source}=registry" for source in sources]
    flags += os.environ.get("RUSTFLAGS", "").split()
    environment = {**os.environ, "CARGO_ENCODED_RUSTFLAGS": "\x1f".join(flags)}
    subprocess.run(["cargo", "build", "--locked", "--profile", "dist", "--bin", "fluxmorph"], check=True, cwd=HOME,
                   env=environment)


def generated(binary):
    """Man pages, completions and schema, as far as the program writes them."""
    files = {}
    wanted = {f"share/completions/{name}": ["completions", shell] for shell, name in SHELLS.items()}
    wanted |= {"share/fluxmorph.schema.json": ["schema"]}
    with tempfile.TemporaryDirectory() as folder:
        # One page for each command.
        subprocess.run([binary, "generate", "man", "--out", folder], stderr=subprocess.DEVNULL, check=False)
        for page in sorted(Path(folder).glob("*.1")):
            files[f"share/man/man1/{page.name}"] = page.read_bytes()
    if not files:
        wanted |= {"share/man/man1/fluxmorph.1": ["man"]}
    for name, arguments in wanted.items():
        result = subprocess.run([binary, "generate", *arguments], stdout=subprocess.PIPE, check=False)
        if result.returncode == 0 and result.stdout:
            files[name] = result.stdout
        else:
            print(f"left out: {name}, `fluxmorph generate {' '.join(arguments)}` prints nothing", file=sys.stderr)
    return files


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
    expected, named = Path(f"{packed}.sha256").read_text(encoding="ascii").split()
    require(named == packed.name, "the checksum names another file")
    require(hashlib.sha256(packed.read_bytes()).hexdigest() == expected, "the checksum is not that of the archive")
    with tempfile.TemporaryDirectory() as folder:
        with tarfile.open(packed) as tar:
            tar.extractall(folder)
        unpacked = Path(folder, name)
        binary = unpacked / "fluxmorph"
        said = output_of([str(binary), "--version"]).strip()
        require(said == f"fluxmorph {version}", f"`--version` prints {said!r}")
        checked = json.loads(output_of([str(binary), "check", str(HOME / "configs/shield_quick.toml"), "--json"]))
        require(checked, "`check` prints nothing")
        json.loads((unpacked / "sbom.cdx.json").read_text(encoding="utf-8"))
        starts = []
        for _ in range(20):
            begin = time.perf_counter()
            output_of([str(binary), "--version"])
            starts.append(time.perf_counter() - begin)
    print(f"start          {1e3 * min(starts):9.1f} ms, the fastest of 20")
    require(min(starts) <= LONGEST_START, f"the program takes {min(starts):.3f} s to start")


def main():
    parser = argparse.ArgumentParser(description="Packs the release archive.")
    parser.add_argument("--no-build", action="store_true", help="take target/dist/fluxmorph as it is")
    parser.add_argument("--output", type=Path, help="folder of the archive [default: target/dist]")
    options = parser.parse_args()
    if not options.no_build:
        build()
    metadata = json.loads(output_of(["cargo", "metadata", "--no-deps", "--format-version", "1"]))
    folder = Path(metadata["target_directory"])
    binary = folder / "dist/fluxmorph"
    require(binary.is_file(), f"there is no {binary}; leave --no-build out")
    packages, edges = release_graph()
    version = next(p["version"] for (name, _), p in packages.items() if name == "fluxmorph")
    seconds = commit_time()
    libraries = c_libraries(packages)
    files = {"fluxmorph": binary.read_bytes()}
    size = len(files["fluxmorph"])
    require(size <= LARGEST_BINARY, f"the binary has {size} bytes, more than {LARGEST_BINARY}")
    for name in ("README.md", "CHANGELOG.md", "LICENSE-MIT", "LICENSE-APACHE"):
        files[name] = (HOME / name).read_bytes()
    files["THIRD-PARTY.md"] = third_party(packages, libraries).encode()
    files["sbom.cdx.json"] = sbom(packages, edges, libraries, seconds).encode()
    files |= generated(binary)
    name = f"fluxmorph-{version}-{host()}"
    output = (options.output or folder / "dist").resolve()
    output.mkdir(parents=True, exist_ok=True)
    packed = output / f"{name}.tar.gz"
    packed.write_bytes(archive(name, files, seconds))
    digest = hashlib.sha256(packed.read_bytes()).hexdigest()
    Path(f"{packed}.sha256").write_text(f"{digest}  {packed.name}\n", encoding="ascii")
    print(f"packages       {len(packages):9d}")
    print(f"binary         {size:9d} bytes")
    print(f"archive        {packed.stat().st_size:9d} bytes, {len(files)} files")
    try_out(packed, name, version)
    print(f"sha256         {digest}")
    print(packed)


if __name__ == "__main__":
    main()
