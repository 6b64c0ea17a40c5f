//! Keys and values of every table of a shipped configuration.

use crate::case::{Base, Case, case, compare};

const QUICK: Base = Base::Shipped("shield_quick.toml");
const SPHERE: Base = Base::Shipped("sphere.toml");

pub(crate) const CASES: &[Case] = &[
    case("title is a number", QUICK, &[("\"Shield plate, coarse and quick\"", "«5»")]),
    case("title is empty", QUICK, &[("\"Shield plate, coarse and quick\"", "«\"\"»")]),
    case("table misspelt", QUICK, &[("[optimizer]", "[«optimiser»]")]),
    case("unknown table far from any", QUICK, &[("[optimizer]", "[«postprocessing»]\n[optimizer]")]),
    case("mesh.generator misspelt", QUICK, &[("generator = \"shield\"", "«generater» = \"shield\"")]),
    case(
        "mesh.generator is an unknown word",
        QUICK,
        &[("generator = \"shield\"", "generator = «\"sheild\"»")],
    ),
    case(
        "mesh.file beside a generator",
        QUICK,
        &[("generator = \"shield\"", "generator = \"shield\"\nfile = «\"a.msh\"»")],
    ),
    case(
        "mesh.unit beside a generator",
        QUICK,
        &[("generator = \"shield\"", "generator = \"shield\"\nunit = «\"mm\"»")],
    ),
    case(
        "table of another generator",
        QUICK,
        &[("[analysis]", "«[mesh.block]»\ncells = [2, 2, 2]\n\n[analysis]")],
    ),
    case(
        "mesh.shield.plate has two lengths",
        QUICK,
        &[("[\"120 mm\", \"240 mm\", \"10 mm\"]", "«[\"120 mm\", \"240 mm\"]»")],
    ),
    case("mesh.shield.plate holds a frequency", QUICK, &[("\"10 mm\"]", "«\"10 Hz\"»]")]),
    case("mesh.shield.skin is a word", QUICK, &[("skin = []", "skin = «\"none\"»")]),
    case("mesh.shield.skin does not grow", QUICK, &[("skin = []", "skin = [\"1 mm\", «\"0.5 mm\"»]")]),
    case("mesh.shield.refinement is too large", QUICK, &[("refinement = 0.5", "refinement = «50»")]),
    case("mesh.shield.refinement with a unit", QUICK, &[("refinement = 0.5", "refinement = «\"0.5 mm\"»")]),
    case(
        "mesh.shield.coil_z upside down",
        QUICK,
        &[("skin = []", "coil_z = «[\"80 mm\", \"40 mm\"]»\nskin = []")],
    ),
    case(
        "mesh.shield.observation_cells is broken",
        QUICK,
        &[("skin = []", "observation_cells = [2, «6.5»]\nskin = []")],
    ),
    case("mesh.shield key in plural", QUICK, &[("skin = []", "«skins» = []")]),
    case("analysis.frequency is a length", QUICK, &[("\"60 Hz\"", "«\"60 mm\"»")]),
    case("analysis.frequency in lower case", QUICK, &[("\"60 Hz\"", "«\"60 hz\"»")]),
    case("analysis.frequency without unit in quotes", QUICK, &[("\"60 Hz\"", "«\"60\"»")]),
    case("analysis.frequency is NaN", QUICK, &[("\"60 Hz\"", "«nan»")]),
    case("analysis.frequency is infinite", QUICK, &[("\"60 Hz\"", "«inf»")]),
    case("analysis.frequency is negative", QUICK, &[("\"60 Hz\"", "«\"-60 Hz\"»")]),
    case("analysis.frequency is a truth value", QUICK, &[("\"60 Hz\"", "«true»")]),
    case("analysis.frequency is a date", QUICK, &[("\"60 Hz\"", "«2024-01-01»")]),
    case("analysis.frequency and frequencies", QUICK, &[("\"60 Hz\"", "\"60 Hz\"\nfrequencies = «[50]»")]),
    case("analysis.frequencies is empty", QUICK, &[("frequency = \"60 Hz\"", "frequencies = «[]»")]),
    case(
        "analysis.frequencies has one twice",
        QUICK,
        &[("frequency = \"60 Hz\"", "frequencies = [50, 60, «50»]")],
    ),
    case("analysis.penalty is zero", QUICK, &[("\"60 Hz\"", "\"60 Hz\"\npenalty = «0»")]),
    case("analysis.order is three", QUICK, &[("\"60 Hz\"", "\"60 Hz\"\norder = «3»")]),
    case("analysis.order is a word", QUICK, &[("\"60 Hz\"", "\"60 Hz\"\norder = «\"2\"»")]),
    case(
        "analysis.linear_solver is a word",
        QUICK,
        &[("\"60 Hz\"", "\"60 Hz\"\nlinear_solver = «\"direct\"»")],
    ),
    case(
        "analysis.linear_solver.method misspelt",
        QUICK,
        &[("\"60 Hz\"", "\"60 Hz\"\nlinear_solver.method = «\"dirct\"»")],
    ),
    case(
        "analysis.linear_solver.tolerance too coarse",
        QUICK,
        &[("\"60 Hz\"", "\"60 Hz\"\nlinear_solver.tolerance = «1e-3»")],
    ),
    case("materials key misspelt", QUICK, &[("conductivity = ", "«conductivty» = ")]),
    case("materials.conductivity is a resistivity", QUICK, &[("\"7e6 S/m\"", "«\"1.4e-7 Ohm m\"»")]),
    case(
        "materials.conductivity is a list",
        QUICK,
        &[("\"7e6 S/m\"", "«[\"7e6 S/m\", \"7e6 S/m\", \"1 S/m\"]»")],
    ),
    case("materials.relative_permeability is zero", QUICK, &[("= 800", "= «0»")]),
    case("materials.relative_permeability in quotes", QUICK, &[("= 800", "= «\"800\"»")]),
    case("materials.density with a wrong unit", QUICK, &[("= 800", "= 800\ndensity = «\"7850 kg\"»")]),
    case(
        "materials holds a value",
        QUICK,
        &[("[materials.steel]", "[materials]\nair = «1»\n[materials.steel]")],
    ),
    case("regions.material is not there", QUICK, &[("material = \"steel\"", "material = «\"stele\"»")]),
    case("regions.model misspelt", QUICK, &[("model = \"impedance\"", "model = «\"impedence\"»")]),
    case(
        "regions.remanence at a frequency",
        QUICK,
        &[("model = \"impedance\"", "model = \"impedance\"\nremanence = «[0, 0, 1]»")],
    ),
    case(
        "regions.remanence is zero",
        SPHERE,
        &[("material = \"metal\"", "material = \"metal\"\nremanence = «[0, 0, 0]»"), ("\"50 Hz\"", "0")],
    ),
    case("coils with single brackets", QUICK, &[("[[coils]]", "«[coils]»")]),
    case("coils.shape misspelt", QUICK, &[("\"racetrack\"", "«\"race_track\"»")]),
    case("coils.ampere_turns without k", QUICK, &[("\"40 kA\"", "«\"40 KA\"»")]),
    case("coils.ampere_turns is zero", QUICK, &[("\"40 kA\"", "«0»")]),
    case(
        "coils.ampere_turns missing",
        QUICK,
        &[("ampere_turns = \"40 kA\"\n", ""), ("[[coils]]", "«[[coils]]»")],
    ),
    case(
        "coils.center has two coordinates",
        QUICK,
        &[("[\"0 mm\", \"0 mm\", \"60 mm\"]", "«[\"0 mm\", \"0 mm\"]»")],
    ),
    case("coils.center is a number", QUICK, &[("[\"0 mm\", \"0 mm\", \"60 mm\"]", "«60»")]),
    case("coils.axis is no axis", QUICK, &[("axis = \"z\"", "axis = «\"up\"»")]),
    case("coils.axis has no length", QUICK, &[("axis = \"z\"", "axis = «[0, 0, 0]»")]),
    case(
        "coils.direction along the axis",
        QUICK,
        &[("axis = \"z\"", "axis = \"z\"\ndirection = «[0, 0, 1]»")],
    ),
    case(
        "coils.half_window is negative",
        QUICK,
        &[("[\"60 mm\", \"160 mm\"]", "[\"60 mm\", «\"-160 mm\"»]")],
    ),
    case(
        "coils.inner_radius beside corner",
        QUICK,
        &[("corner = \"mitred\"", "corner = \"mitred\"\ninner_radius = «\"22 mm\"»")],
    ),
    case("coils.inner_radius is too large", QUICK, &[("corner = \"mitred\"", "inner_radius = «\"70 mm\"»")]),
    case(
        "coils.radius of a racetrack",
        QUICK,
        &[("corner = \"mitred\"", "corner = \"mitred\"\n«radius» = \"22 mm\"")],
    ),
    case(
        "coils.region beside shape",
        QUICK,
        &[("corner = \"mitred\"", "corner = \"mitred\"\nregion = «\"air\"»")],
    ),
    case(
        "coils.phase in a wrong dimension",
        QUICK,
        &[("corner = \"mitred\"", "corner = \"mitred\"\nphase = «\"30 mm\"»")],
    ),
    case(
        "coils.phase in full words",
        QUICK,
        &[("corner = \"mitred\"", "corner = \"mitred\"\nphase = «\"30 degrees\"»")],
    ),
    case(
        "two coils of one name",
        QUICK,
        &[(
            "[boundaries]",
            "[[coils]]\nname = «\"coil\"»\nshape = \"circular\"\nampere_turns = 1\ncenter = [0, 0, 0.06]\nradius = 0.1\nwidth = 0.02\nheight = 0.02\n\n[boundaries]",
        )],
    ),
    case(
        "boundaries.flux_parallel is a word",
        QUICK,
        &[("[\"x_min\", \"x_max\", \"y_min\", \"y_max\", \"z_min\", \"z_max\"]", "«\"x_min\"»")],
    ),
    case(
        "boundaries.flux_parallel names one twice",
        QUICK,
        &[("\"z_min\", \"z_max\"]", "\"z_min\", \"z_max\", «\"x_min\"»]")],
    ),
    case(
        "boundaries.flux_normal names one of the other list",
        QUICK,
        &[("[objective]", "flux_normal = [«\"x_min\"»]\n\n[objective]")],
    ),
    case(
        "boundaries.uniform_field without b",
        SPHERE,
        &[("{ surfaces = [\"outer\"], b = [0.0, 0.0, \"1 T\"] }", "«{ surfaces = [\"outer\"] }»")],
    ),
    case("boundaries.uniform_field.b is zero", SPHERE, &[("[0.0, 0.0, \"1 T\"]", "«[0, 0, 0]»")]),
    case(
        "boundaries.uniform_field on a surface of another list",
        SPHERE,
        &[
            ("flux_normal = [\"z_min\"]", "flux_normal = [\"outer\", \"z_min\"]"),
            ("surfaces = [\"outer\"]", "surfaces = [«\"outer\"»]"),
        ],
    ),
    case("objective.kind misspelt", QUICK, &[("\"flux_density_squared\"", "«\"flux_density_square\"»")]),
    case(
        "objective.region is missing",
        QUICK,
        &[("region = \"observation\"\n", ""), ("[objective]", "«[objective]»")],
    ),
    case("objective.weighting in plural", QUICK, &[("\"point\"", "«\"points\"»")]),
    case("objective.target has no use", QUICK, &[("weighting = \"point\"", "target = «[0, 0, 1]»")]),
    case("objective.weight is zero", QUICK, &[("weighting = \"point\"", "weight = «0»")]),
    case(
        "objective.frequency is not analysed",
        QUICK,
        &[("weighting = \"point\"", "frequency = «\"50 Hz\"»")],
    ),
    case("objective.goal misspelt", QUICK, &[("weighting = \"point\"", "goal = «\"maximize\"»")]),
    case(
        "constraints.kind is missing",
        QUICK,
        &[("[design]", "«[[constraints]]»\nregion = \"plate\"\nupper_ratio = 1.1\n\n[design]")],
    ),
    case(
        "constraints.upper in a wrong dimension",
        QUICK,
        &[(
            "[design]",
            "[[constraints]]\nkind = \"volume\"\nregion = \"plate\"\nupper = «\"2 kg\"»\n\n[design]",
        )],
    ),
    case(
        "constraints.upper_ratio beside upper",
        QUICK,
        &[(
            "[design]",
            "[[constraints]]\nkind = \"volume\"\nregion = \"plate\"\nupper = \"1 l\"\nupper_ratio = «1.1»\n\n[design]",
        )],
    ),
    case(
        "constraints.name with a comma",
        QUICK,
        &[(
            "[design]",
            "[[constraints]]\nname = «\"a,b\"»\nkind = \"volume\"\nregion = \"plate\"\nupper_ratio = 1.1\n\n[design]",
        )],
    ),
    case(
        "constraints.maximum below the minimum",
        QUICK,
        &[(
            "[design]",
            "[[constraints]]\nkind = \"thickness\"\nminimum = \"8 mm\"\nmaximum = «\"6 mm\"»\n\n[design]",
        )],
    ),
    case("design.direction is a wrong word", QUICK, &[("[0.0, 0.0, -1.0] ", "«\"normals\"»")]),
    case("design.direction has no length", QUICK, &[("[0.0, 0.0, -1.0]", "«[0.0, 0.0, 0.0]»")]),
    case("design.direction holds a text", QUICK, &[("[0.0, 0.0, -1.0]", "[0.0, 0.0, «\"-1\"»]")]),
    case("design.grid with one point", QUICK, &[("[7, 13]", "[7, «1»]")]),
    case(
        "design.grid beside filter_radius",
        QUICK,
        &[("grid = [7, 13]", "grid = [7, 13]\nfilter_radius = «\"20 mm\"»")],
    ),
    case("design.upper below lower", QUICK, &[("upper = \"20 mm\"", "upper = «\"-20 mm\"»")]),
    case(
        "design.initial outside of the bounds",
        QUICK,
        &[("upper = \"20 mm\"", "upper = \"20 mm\"\ninitial = «\"21 mm\"»")],
    ),
    case("design.lower in a misspelt unit", QUICK, &[("lower = \"-5 mm\"", "lower = «\"-5 MM\"»")]),
    case("design.rim misspelt", QUICK, &[("grid = [7, 13]", "grid = [7, 13]\nrim = «\"fix\"»")]),
    case(
        "design.symmetry across the direction",
        QUICK,
        &[("grid = [7, 13]", "grid = [7, 13]\nsymmetry = [{ axis = «\"z\"» }]")],
    ),
    case("remesh.poisson is a half", QUICK, &[("poisson = 0.3", "poisson = «0.5»")]),
    case("remesh.stiffness with a hyphen", QUICK, &[("\"inverse_size\"", "«\"inverse-size\"»")]),
    case("remesh.region is an empty list", QUICK, &[("region = \"remesh\"", "region = «[]»")]),
    case(
        "remesh.box beside region",
        QUICK,
        &[("region = \"remesh\"", "region = \"remesh\"\nbox = «[[0, 0, 0], [1, 1, 1]]»")],
    ),
    case("remesh.box without volume", QUICK, &[("region = \"remesh\"", "box = «[[0, 0, 0], [1, 1, 0]]»")]),
    case(
        "remesh.fixed names one of slide",
        QUICK,
        &[(
            "stiffness = \"inverse_size\"\nslide = [\"x_min\", \"y_min\", \"plate_side\"]",
            "stiffness = \"inverse_size\"\nslide = [\"x_min\", \"y_min\"]\nfixed = [«\"y_min\"»]",
        )],
    ),
    case("remesh.rounds is negative", QUICK, &[("poisson = 0.3", "rounds = «-1»")]),
    case("remesh key of many words misspelt", QUICK, &[("poisson = 0.3", "«inversionshare» = 0.9")]),
    case("optimizer.algorithm misspelt", QUICK, &[("\"mma\"", "«\"mna\"»")]),
    case("optimizer.algorithm in capitals", QUICK, &[("\"mma\"", "«\"MMA\"»")]),
    case("optimizer.max_evaluations is zero", QUICK, &[("max_evaluations = 5", "max_evaluations = «0»")]),
    case(
        "optimizer.max_evaluations in quotes",
        QUICK,
        &[("max_evaluations = 5", "max_evaluations = «\"5\"»")],
    ),
    case("optimizer.max_time in a length", QUICK, &[("max_evaluations = 5", "max_time = «\"5 m\"»")]),
    case("optimizer key abbreviated", QUICK, &[("max_evaluations = 5", "«max_eval» = 5")]),
    case(
        "probes.points is empty",
        QUICK,
        &[("[[\"0 mm\", \"0 mm\", \"-50 mm\"], [\"20 mm\", \"60 mm\", \"-50 mm\"]]", "«[]»")],
    ),
    case(
        "probes.points is one point",
        QUICK,
        &[("[[\"0 mm\", \"0 mm\", \"-50 mm\"], [\"20 mm\", \"60 mm\", \"-50 mm\"]]", "[«0», 0.1, 0.2]")],
    )
    .with(3),
    case(
        "two probes of one name",
        QUICK,
        &[("[output]", "[[probes]]\nname = «\"behind the plate\"»\npoints = [[0, 0, -0.05]]\n\n[output]")],
    ),
    case("output.fields misspelt", QUICK, &[("\"first_last\"", "«\"firstlast\"»")]),
    case("output.mesh in quotes", QUICK, &[("fields = \"first_last\"", "mesh = «\"true\"»")]),
    case(
        "output.verify_refinement between its ranges",
        QUICK,
        &[("fields = \"first_last\"", "verify_refinement = «0.1»")],
    ),
    case("output.directory leads upwards", QUICK, &[("\"runs/shield_quick\"", "«\"../runs\"»")]),
];

#[test]
fn tables_and_values() {
    compare("tables", CASES);
}
