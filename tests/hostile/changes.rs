//! One change each to a shipped configuration, and what must be said about it.

use std::fs;
use std::path::Path;

/// The shipped configurations that are changed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Base {
    Quick,
    Sphere,
    Pole,
    Block,
}

use Base::{Block, Pole, Quick, Sphere};

impl Base {
    pub(crate) fn text(self) -> String {
        let name = match self {
            Quick => "shield_quick",
            Sphere => "sphere",
            Pole => "pole",
            Block => "block_table1",
        };
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("configs/{name}.toml"));
        fs::read_to_string(path).expect("a shipped configuration")
    }
}

/// What is changed in which configuration, and what the message says.
pub(crate) type Change = (Base, &'static str, &'static str, &'static [&'static str]);

/// Types that are not those of the key.
const TYPES: &[Change] = &[
    (Quick, "title = \"", "title = 5 # \"", &["`title` is the whole number 5, not a text"]),
    (Quick, "title = \"", "title = [] # \"", &["`title` is a list of 0"]),
    (Quick, "title = \"", "title = \"\" # \"", &["`title` is empty"]),
    (Quick, "title = \"", "title = \"   \" # \"", &["`title` is empty"]),
    (Quick, "title = \"", "title = 1979-05-27 # \"", &["`title` is a date"]),
    (Block, "[mesh]\n", "mesh = 5\n[mesh_]\n", &["`mesh` is the whole number 5, not a table"]),
    (Quick, "[mesh]\n", "[[mesh]]\n", &["mesh"]),
    (Quick, "[[coils]]", "[coils]", &["`coils` is a table, not a list of tables"]),
    (Quick, "[[probes]]", "[probes.a]", &["`probes` is a table"]),
    (Quick, "generator = \"shield\"", "generator = 1", &["`mesh.generator` is the whole number 1"]),
    (Quick, "refinement = 0.5", "refinement = \"0.5\"", &["`mesh.shield.refinement` is the text \"0.5\""]),
    (Quick, "refinement = 0.5", "refinement = true", &["`mesh.shield.refinement` is `true`"]),
    (Quick, "refinement = 0.5", "refinement = [0.5]", &["`mesh.shield.refinement` is a list of 1"]),
    (Quick, "frequency = \"60 Hz\"", "frequency = {}", &["`analysis.frequency` is a table"]),
    (Quick, "frequency = \"60 Hz\"", "frequency = false", &["`analysis.frequency` is `false`"]),
    (Quick, "grid = [7, 13]", "grid = [7.5, 13]", &["`design.grid[0]` is the number 7.5"]),
    (Quick, "grid = [7, 13]", "grid = 7", &["`design.grid` is the whole number 7, not a list"]),
    (Quick, "grid = [7, 13]", "grid = [[7], [13]]", &["`design.grid[0]` is a list of 1"]),
    (
        Quick,
        "max_evaluations = 5",
        "max_evaluations = 5.0",
        &["`optimizer.max_evaluations`", "not a whole number"],
    ),
    (Quick, "max_evaluations = 5", "max_evaluations = \"5\"", &["`optimizer.max_evaluations`"]),
    (Quick, "[\"x_min\", \"y_min\", \"plate_side\"]", "[1, 2]", &["`remesh.slide[0]` is the whole number 1"]),
    (Quick, "[\"x_min\", \"y_min\", \"plate_side\"]", "[[\"x_min\"]]", &["`remesh.slide[0]` is a list"]),
    (Quick, "points = [[", "points = [[[", &["device.toml:"]),
    (Quick, "center = [\"0 mm\", ", "center = [", &["`coils[0].center` has 2 items"]),
    (
        Quick,
        "half_window = [\"60 mm\", ",
        "half_window = [\"60 mm\", \"60 mm\", ",
        &["`coils[0].half_window` has 3 items"],
    ),
];

/// Units that are missing, wrong or made up.
const UNITS: &[Change] = &[
    (Quick, "\"60 Hz\"", "\"60\"", &["`analysis.frequency`", "no unit"]),
    (Quick, "\"60 Hz\"", "\"Hz\"", &["`analysis.frequency`"]),
    (Quick, "\"60 Hz\"", "\"60 parsec\"", &["`analysis.frequency`", "parsec"]),
    (Quick, "\"60 Hz\"", "\"60 Hz Hz\"", &["`analysis.frequency`"]),
    (Quick, "\"60 Hz\"", "\"sixty Hz\"", &["`analysis.frequency`"]),
    (Quick, "\"60 Hz\"", "\"0x3c Hz\"", &["`analysis.frequency`"]),
    (Quick, "\"60 Hz\"", "\"1e999 Hz\"", &["`analysis.frequency`"]),
    (Quick, "\"60 Hz\"", "\"6\u{0660} Hz\"", &["`analysis.frequency`"]),
    (Quick, "\"60 Hz\"", "\"60\\u0000Hz\"", &["`analysis.frequency`"]),
    (Quick, "\"60 Hz\"", "\"\\u001b[31m60 Hz\"", &["`analysis.frequency`"]),
    (Quick, "\"7e6 S/m\"", "\"7e6 Ohm m\"", &["`materials.steel.conductivity`"]),
    (Quick, "\"40 kA\"", "\"40 kV\"", &["`coils[0].ampere_turns`"]),
    (Quick, "upper = \"20 mm\"", "upper = \"20 mm2\"", &["`design.upper`"]),
    (Quick, "upper = \"20 mm\"", "upper = \"20 Mm\"", &["`design.upper`"]),
];

/// Numbers that are none, or that no device has.
const NUMBERS: &[Change] = &[
    (Quick, "\"60 Hz\"", "nan", &["`analysis.frequency` is NaN"]),
    (Quick, "\"60 Hz\"", "-nan", &["`analysis.frequency` is NaN"]),
    (Quick, "\"60 Hz\"", "inf", &["`analysis.frequency` is inf"]),
    (Quick, "\"60 Hz\"", "-inf", &["`analysis.frequency` is -inf"]),
    (Quick, "\"60 Hz\"", "1e400", &["`analysis.frequency`"]),
    (Quick, "\"60 Hz\"", "-60", &["`analysis.frequency` is -60 Hz"]),
    (Quick, "\"60 Hz\"", "\"-60 Hz\"", &["`analysis.frequency` is -60 Hz"]),
    (
        Quick,
        "relative_permeability = 800",
        "relative_permeability = -1",
        &["`materials.steel.relative_permeability`"],
    ),
    (
        Quick,
        "relative_permeability = 800",
        "relative_permeability = 0",
        &["`materials.steel.relative_permeability`"],
    ),
    (
        Quick,
        "relative_permeability = 800",
        "relative_permeability = inf",
        &["`materials.steel.relative_permeability`"],
    ),
    (Quick, "\"7e6 S/m\"", "\"-7e6 S/m\"", &["`materials.steel.conductivity`"]),
    (Quick, "width = \"20 mm\"", "width = \"-20 mm\"", &["`coils[0].width`"]),
    (Quick, "width = \"20 mm\"", "width = 1e300", &["`coils[0].width` is 1e300 m"]),
    (Quick, "height = \"40 mm\"", "height = nan", &["`coils[0].height` is NaN"]),
    (Quick, "\"120 mm\", \"240 mm\"", "\"-120 mm\", \"240 mm\"", &["`mesh.shield.plate[0]`"]),
    (Quick, "\"120 mm\", \"240 mm\"", "1e300, 1e300", &["mesh.shield"]),
    (Quick, "refinement = 0.5", "refinement = 0", &["`mesh.shield.refinement`"]),
    (Quick, "refinement = 0.5", "refinement = -1", &["`mesh.shield.refinement`"]),
    (Quick, "refinement = 0.5", "refinement = 1e9", &["`mesh.shield.refinement`"]),
    (Quick, "refinement = 0.5", "growth = 0", &["`mesh.shield.growth`"]),
    (Quick, "refinement = 0.5", "pitch = 1e-300", &["pitch"]),
    (Quick, "refinement = 0.5", "observation_cells = [0, 1]", &["`mesh.shield.observation_cells[0]`"]),
    (Quick, "refinement = 0.5", "observation_cells = [-1, 1]", &["`mesh.shield.observation_cells[0]`"]),
    (Quick, "skin = []", "skin = [\"2 mm\", \"1 mm\"]", &["mesh.shield.skin"]),
    (Quick, "skin = []", "skin = [0]", &["`mesh.shield.skin[0]`"]),
    (Quick, "grid = [7, 13]", "grid = [0, 13]", &["`design.grid[0]`"]),
    (Quick, "grid = [7, 13]", "grid = [7, -13]", &["`design.grid[1]`"]),
    (Quick, "grid = [7, 13]", "grid = [31622, 31622]", &["`design.grid[0]`"]),
    (Quick, "grid = [7, 13]", "grid = [9223372036854775807, 2]", &["`design.grid[0]`"]),
    (Quick, "grid = [7, 13]", "grid = [99999999999999999999, 2]", &["`design.grid[0]`"]),
    (Quick, "direction = [0.0, 0.0, -1.0]", "direction = [0, 0, 0]", &["design.direction"]),
    (Quick, "direction = [0.0, 0.0, -1.0]", "direction = [nan, 0, 0]", &["`design.direction[0]` is NaN"]),
    (Quick, "direction = [0.0, 0.0, -1.0]", "direction = [1e200, 0, 1e200]", &["design.direction"]),
    (Quick, "poisson = 0.3", "poisson = 0.5", &["`remesh.poisson`"]),
    (Quick, "poisson = 0.3", "poisson = -1", &["`remesh.poisson`"]),
    (Quick, "max_evaluations = 5", "max_evaluations = 0", &["`optimizer.max_evaluations`"]),
    (
        Quick,
        "max_evaluations = 5",
        "max_evaluations = 18446744073709551616",
        &["`optimizer.max_evaluations`"],
    ),
    (Quick, "max_evaluations = 5", "ftol_rel = -1", &["`optimizer.ftol_rel`"]),
    (Quick, "max_evaluations = 5", "max_time = \"-1 s\"", &["`optimizer.max_time`"]),
    (Quick, "\"-50 mm\"]]", "1e5]]", &["outside the mesh"]),
    (Quick, "\"-50 mm\"]]", "nan]]", &["`probes[0].points[1][2]` is NaN"]),
    (Sphere, "radius = \"50 mm\"", "radius = 0", &["`mesh.sphere.radius`"]),
    (Sphere, "outer_radius = \"400 mm\"", "outer_radius = \"1 mm\"", &["mesh.sphere.outer_radius"]),
    (Sphere, "growth = 1.35", "growth = 0.5", &["`mesh.sphere.growth`"]),
    (Sphere, "order = 2", "order = 3", &["`analysis.order`"]),
    (Sphere, "b = [0.0, 0.0, \"1 T\"]", "b = [inf, 0, 0]", &["uniform_field.b[0]`"]),
];

/// Meshes of a size that nobody has memory for.
const SIZES: &[Change] = &[
    (
        Block,
        "generator = \"block\"",
        "generator = \"block\"\nblock.cells = [1000, 1000, 1000]",
        &["at most 50000000 tetrahedra"],
    ),
    (
        Block,
        "generator = \"block\"",
        "generator = \"block\"\nblock.cells = [1000000000, 1, 1]",
        &["`mesh.block.cells[0]`"],
    ),
    (
        Block,
        "generator = \"block\"",
        "generator = \"block\"\nblock.cells = [-1, 1, 1]",
        &["`mesh.block.cells[0]`"],
    ),
    (
        Block,
        "generator = \"block\"",
        "generator = \"block\"\nblock.cells = [0, 1, 1]",
        &["`mesh.block.cells[0]`"],
    ),
    (
        Block,
        "generator = \"block\"",
        "generator = \"block\"\nblock.cells = [200, 200, 200]",
        &["48000000 tetrahedra needs about", "--force"],
    ),
    (Quick, "refinement = 0.5", "refinement = 20", &["mesh"]),
    (Quick, "refinement = 0.5", "in_plane_size = 1e-9", &["mesh.shield"]),
    (Quick, "refinement = 0.5", "air_layer = 1e-12", &["mesh.shield"]),
    (Quick, "refinement = 0.5", "outer = [1e6, 1e6]\nin_plane_size = \"1 mm\"\ngrowth = 1", &["mesh.shield"]),
    (Sphere, "divisions = 6", "divisions = 1000", &["at most 50000000 tetrahedra"]),
    (Sphere, "divisions = 6", "divisions = 100\nrefinement = 20", &["at most 50000000 tetrahedra"]),
    (Sphere, "divisions = 6", "divisions = 1000000000", &["`mesh.sphere.divisions`"]),
    (Sphere, "growth = 1.35", "air_layer = 1e-12\ngrowth = 1", &["mesh.sphere.air_layer"]),
    (Pole, "size = [\"15 mm\", \"15 mm\", \"10 mm\"]", "size = [1e-9, 1e-9, 1e-9]", &["mesh.boxes"]),
    (
        Pole,
        "size = [\"15 mm\", \"15 mm\", \"10 mm\"]",
        "size = [\"0.1 mm\", \"0.1 mm\", \"0.1 mm\"]",
        &["mesh.boxes"],
    ),
    (Pole, "cells = [3, 3, 1]", "cells = [1000000000, 1, 1]", &["cells[0]`"]),
    (Pole, "cells = [3, 3, 1]", "cells = [10000, 10000, 10000]", &["cells[0]`", "from 1 to 1000"]),
    (Pole, "cells = [3, 3, 1]", "cells = [1000, 1000, 1000]", &["mesh.boxes"]),
    (Pole, "box = [[\"0 mm\", \"0 mm\", \"0 mm\"], [\"400 mm\"", "box = [[0, 0, 0], [1e300", &["mesh"]),
];

/// Keys that contradict each other or the mesh.
const CONTRADICTIONS: &[Change] = &[
    (
        Quick,
        "generator = \"shield\"",
        "generator = \"shield\"\nfile = \"a.msh\"",
        &["`mesh.file` and `mesh.generator`"],
    ),
    (Quick, "generator = \"shield\"", "generator = \"shield\"\nunit = \"mm\"", &["`mesh.unit`"]),
    (Quick, "generator = \"shield\"", "generator = \"block\"", &["`mesh.shield` has no use"]),
    (Quick, "frequency = \"60 Hz\"", "frequency = 60\nfrequency = 50", &["is there twice"]),
    (Quick, "frequency = \"60 Hz\"", "frequency = 60\nfrequencies = [50]", &["frequenc"]),
    (Quick, "frequency = \"60 Hz\"", "frequencies = []", &["analysis.frequencies"]),
    (Quick, "lower = \"-5 mm\"", "lower = \"25 mm\"", &["the bounds cross"]),
    (Quick, "lower = \"-5 mm\"", "lower = \"20 mm\"", &["design"]),
    (Quick, "upper = \"20 mm\"", "upper = \"2e6 m\"", &["`design.upper`"]),
    (
        Quick,
        "model = \"impedance\"",
        "model = \"impedance\"\n[regions.observation]\nmaterial = \"steel\"\nmodel = \"impedance\"",
        &["observation"],
    ),
    (Quick, "material = \"steel\"", "material = \"gold\"", &["there is no material `gold`"]),
    (Quick, "[regions.plate]", "[regions.moon]", &["there is no region `moon`"]),
    (Quick, "\"z_max\"]", "\"z_max\", \"z_max\"]", &["names `z_max` twice"]),
    (Quick, "\"z_max\"]", "\"z_max\", \"plate_bottom\"]", &["faces inside the mesh"]),
    (Quick, "\"z_max\"]", "\"z_max\", \"air|moon\"]", &["there is no region `moon`"]),
    (Quick, "\"z_max\"]", "\"z_max\", \"|\"]", &["there is no region"]),
    (Quick, "\"z_max\"]", "\"z_max\"]\nflux_normal = [\"z_max\"]", &["`z_max`"]),
    (Quick, "surface = \"plate_bottom\"", "surface = []", &["`design.surface` is an empty list"]),
    (Quick, "surface = \"plate_bottom\"", "surface = \"\"", &["`design.surface` is empty"]),
    (
        Quick,
        "points = [[\"0 mm\", \"0 mm\", \"-50 mm\"], [\"20 mm\", \"60 mm\", \"-50 mm\"]]",
        "points = []",
        &["`probes[0].points` is an empty list"],
    ),
    (Quick, "[remesh]", "[remesch]", &["did you mean `remesh`?"]),
    (Quick, "[analysis]", "[analysys]", &["did you mean `analysis`?"]),
    (Quick, "kind = \"flux_density_squared\"", "kind = \"beauty\"", &["`objective.kind` cannot be `beauty`"]),
    (Quick, "algorithm = \"mma\"", "algorithm = \"rm -rf\"", &["`optimizer.algorithm` cannot be `rm -rf`"]),
    (Quick, "fields = \"first_last\"", "fields = \"\\u001b[2J\"", &["`output.fields`"]),
    (Quick, "axis = \"z\"", "axis = \"w\"", &["`coils[0].axis`"]),
    (Block, "[[morph.case]]", "[[morph.case]]\nname = \"own\"\nmesh = 5\n[[morph.case]]", &["mesh"]),
];

/// Names that are no names.
const NAMES: &[Change] = &[
    (
        Quick,
        "title = \"",
        "title = \"\\u001b[31mred\" # \"",
        &["`title` is \"\\u{1b}[31mred\", with a control character"],
    ),
    (Quick, "title = \"", "title = \"two\\nlines\" # \"", &["`title`", "control character"]),
    (Quick, "name = \"coil\"", "name = \"\\u0007\"", &["`coils[0].name`", "control character"]),
    (
        Quick,
        "name = \"behind the plate\"",
        "name = \"\\u009b2J\"",
        &["`probes[0].name`", "control character"],
    ),
    (Quick, "[materials.steel]", "[materials.\"a\\u001b[2J\"]", &["cannot be the name of a table"]),
    (Quick, "[materials.steel]", "[materials.\"\"]", &["cannot be the name of a table"]),
    (Quick, "[regions.plate]", "[regions.\"pl\\u0000ate\"]", &["cannot be the name of a table"]),
    (
        Quick,
        "surface = \"plate_bottom\"",
        "surface = \"plate_bottom\\r\"",
        &["`design.surface`", "control character"],
    ),
    (
        Quick,
        "[optimizer]\n",
        "[optimizer]\n\"\\u001b[31m\" = 5\n",
        &["unknown key `\\u{1b}[31m` in `optimizer`"],
    ),
    (Quick, "[optimizer]\n", "[optimizer]\n\"\" = 5\n", &["unknown key ``"]),
    (Quick, "[optimizer]\n", "[optimizer]\n__proto__ = 5\n", &["unknown key `__proto__`"]),
    (Quick, "[optimizer]\n", "[optimizer]\nexec = \"touch x\"\n", &["unknown key `exec`"]),
    (Quick, "[optimizer]\n", "include = \"/etc/passwd\"\n[optimizer]\n", &["unknown key `include`"]),
];

/// Paths that lead elsewhere, and text that a shell would expand.
const PATHS: &[Change] = &[
    (
        Block,
        "generator = \"block\"",
        "file = \"../a.msh\"\nunit = \"mm\"",
        &["`mesh.file`", "upwards", "--allow-outside"],
    ),
    (Block, "generator = \"block\"", "file = \"a/../../a.msh\"\nunit = \"mm\"", &["upwards"]),
    (
        Block,
        "generator = \"block\"",
        "file = \"/etc/passwd\"\nunit = \"mm\"",
        &["`mesh.file`", "an absolute path", "--allow-outside"],
    ),
    (Block, "generator = \"block\"", "file = \"//etc/passwd\"\nunit = \"mm\"", &["an absolute path"]),
    (
        Block,
        "generator = \"block\"",
        "file = \"a\\u0000b\"\nunit = \"mm\"",
        &["`mesh.file`", "control character"],
    ),
    (Block, "generator = \"block\"", "file = \"\"\nunit = \"mm\"", &["`mesh.file` is empty"]),
    (
        Quick,
        "directory = \"runs/shield_quick\"",
        "directory = \"../runs\"",
        &["`output.directory`", "upwards", "--out"],
    ),
    (
        Quick,
        "directory = \"runs/shield_quick\"",
        "directory = \"/tmp/runs\"",
        &["`output.directory`", "an absolute path", "--out"],
    ),
    (Quick, "directory = \"runs/shield_quick\"", "directory = \"runs/..\"", &["upwards"]),
    (
        Quick,
        "directory = \"runs/shield_quick\"",
        "directory = \"a\\nb\"",
        &["`output.directory`", "control character"],
    ),
];

/// What is no TOML.
const SYNTAX: &[Change] = &[
    (Quick, "[mesh]", "[mesh", &["not valid TOML"]),
    (Quick, "grid = [7, 13]", "grid = [7, 13", &["not valid TOML"]),
    (Quick, "title = \"", "title = ", &["not valid TOML"]),
    (Quick, "title = \"", "title \"", &["not valid TOML"]),
    (Quick, "title = \"", "title = \"\\x\" # ", &["not valid TOML"]),
    (Quick, "title = \"", "title = \"\\ud800\" # ", &["not valid TOML"]),
    (Quick, "title = \"", "= \"", &["not valid TOML"]),
    (Quick, "[mesh]", "[[[mesh]]]", &["not valid TOML"]),
    (Quick, "frequency = \"60 Hz\"", "frequency = 60 Hz", &["not valid TOML"]),
    (Quick, "frequency = \"60 Hz\"", "frequency.x = 1\nfrequency = 2", &["not valid TOML"]),
];

/// All of them.
pub(crate) const TABLES: [&[Change]; 8] =
    [TYPES, UNITS, NUMBERS, SIZES, CONTRADICTIONS, NAMES, PATHS, SYNTAX];
