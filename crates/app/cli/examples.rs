//! Examples at the end of the help of every command: what one types first, and what one looks up.

pub(super) const FLUXMORPH: &str = "\
Examples:
  fluxmorph init                                  # a starting configuration: shield.toml
  fluxmorph check shield.toml                     # what it means, without solving
  fluxmorph run shield.toml                       # the optimisation, into runs/shield
  fluxmorph report runs/shield                    # one page to read and to send
  fluxmorph run --help                            # all options of a command; -h: in short";

pub(super) const RUN: &str = "\
Examples:
  fluxmorph run shield.toml
  fluxmorph run shield.toml --out runs/first --max-evaluations 10
  fluxmorph run shield.toml --max-time '20 min' --threads 8
  fluxmorph run shield.toml --set analysis.frequency='50 Hz' --set optimizer.algorithm=ccsaq --force
  fluxmorph run shield.toml --json --quiet | jq .objective.ratio

A run that stops at a limit of evaluations or time ends with code 1, and `fluxmorph resume` continues it.";

pub(super) const RESUME: &str = "\
Examples:
  fluxmorph resume runs/shield
  fluxmorph resume runs/shield --max-evaluations 60
  fluxmorph resume runs/shield --max-time '1 h'

Without limits, those of the start or of the last resumption apply.";

pub(super) const SWEEP: &str = "\
Examples:
  fluxmorph sweep shield.toml --set design.upper='10 mm,20 mm' --jobs 2
  fluxmorph sweep shield.toml --set optimizer.algorithm=mma,ccsaq --set analysis.frequency=50,60
  fluxmorph sweep shield.toml --set design.grid='[7,13],[3,5]' --out runs/grids --max-evaluations 10
  fluxmorph sweep shield.toml --set design.upper='10 mm,20 mm' --script sweep.sh && sbatch sweep.sh
  fluxmorph sweep shield.toml --set design.upper='10 mm,20 mm' --compare

The same command again continues: finished runs are skipped, interrupted ones resumed, new values run.
The exit code is the worst of all runs, in this order: 4, 5, 3, 143, 130, 1, 0.";

pub(super) const SOLVE: &str = "\
Examples:
  fluxmorph solve shield.toml
  fluxmorph solve shield.toml --out runs/thick --set mesh.shield.plate='[\"120 mm\", \"240 mm\", \"20 mm\"]'
  fluxmorph solve shield.toml --design runs/shield/result.json --set analysis.frequency='400 Hz' --out runs/other
  fluxmorph solve runs/shield/result.json --refine 1
  fluxmorph solve shield.toml --json --quiet | jq .probes";

pub(super) const MORPH: &str = "\
Examples:
  fluxmorph init block && fluxmorph morph block.toml
  fluxmorph morph block.toml --set remesh.law=hyperelastic --force
  fluxmorph morph block.toml --tune --out runs/tuned";

pub(super) const CHECK: &str = "\
Examples:
  fluxmorph check shield.toml
  fluxmorph check shield.toml --set mesh.shield.refinement=2
  fluxmorph check shield.toml --estimate
  fluxmorph check shield.toml --json | jq '.memory_estimate_bytes / 1e9'";

pub(super) const GRADIENT: &str = "\
Examples:
  fluxmorph gradient shield.toml
  fluxmorph gradient shield.toml --design runs/shield/result.json
  fluxmorph gradient shield.toml --json --quiet > certificate.json";

pub(super) const REPORT: &str = "\
Examples:
  fluxmorph report runs/shield
  fluxmorph report runs/shield --out shield.html";

pub(super) const INIT: &str = "\
Examples:
  fluxmorph init                                  # shield.toml
  fluxmorph init pole                             # pole.toml, from the template of that name
  fluxmorph init magnet --template gmsh           # magnet.toml, magnet.geo, magnet.msh
  fluxmorph init devices/plate --template shield";

pub(super) const GENERATE: &str = "\
Examples:
  fluxmorph generate schema > fluxmorph.schema.json
  fluxmorph generate man --out ~/.local/share/man/man1
  fluxmorph generate man | man -l -
  fluxmorph generate completions bash > ~/.local/share/bash-completion/completions/fluxmorph";

pub(super) const MATERIALS: &str = "\
Examples:
  fluxmorph generate materials
  fluxmorph generate materials team20_steel > steel.csv";

pub(super) const MAN: &str = "\
Examples:
  fluxmorph generate man | man -l -
  fluxmorph generate man --out ~/.local/share/man/man1";

pub(super) const COMPLETIONS: &str = "\
Examples:
  fluxmorph generate completions bash > ~/.local/share/bash-completion/completions/fluxmorph
  fluxmorph generate completions zsh > ~/.zfunc/_fluxmorph
  fluxmorph generate completions fish > ~/.config/fish/completions/fluxmorph.fish
  fluxmorph generate completions powershell >> $PROFILE
  fluxmorph generate completions elvish > ~/.config/elvish/lib/fluxmorph.elv";
