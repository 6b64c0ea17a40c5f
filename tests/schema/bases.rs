//! Valid configurations that the tests change: the shipped ones, and some that together write every table and key.

use fluxmorph::config::Config;

use crate::support::repository;

/// Configurations that together write every key, each with the alternatives that exclude one another.
const WRITTEN: [&str; 8] = [
    r#"
    title = "everything about a shield"
    [mesh]
    generator = "shield"
    [mesh.shield]
    plate = ["120 mm", "240 mm", "10 mm"]
    pitch = "20 mm"
    skin = ["1 mm", "5 mm"]
    side_skin = []
    coil_half_window = ["60 mm", 0.16]
    coil_width = "2 cm"
    coil_z = ["40 mm", "80 mm"]
    observation_x = [0, "40 mm"]
    observation_y = [0, "120 mm"]
    observation_z = ["-60 mm", "-40 mm"]
    observation_cells = [2, 6]
    remesh_upper = ["160 mm", "280 mm"]
    remesh_z = ["-40 mm", "30 mm"]
    outer = ["600 mm", "720 mm"]
    outer_z = ["-400 mm", "480 mm"]
    in_plane_size = "20 mm"
    air_layer = "10 mm"
    side_air = "8 mm"
    growth = 1.6
    refinement = 1
    [analysis]
    frequency = "60 Hz"
    penalty = 1.0
    order = 2
    [analysis.petsc]
    solver = "asm"
    options = "-ksp_gmres_restart 300"

    [analysis.linear_solver]
    method = "direct"
    tolerance = 1e-11
    factor_gib = 4
    reuse = "while_it_pays"
    [materials.steel]
    relative_permeability = 800
    conductivity = "7e6 S/m"
    density = "7850 kg/m3"
    [materials.air]
    [regions.plate]
    material = "steel"
    model = "volume"
    [[coils]]
    name = "mitred"
    shape = "racetrack"
    ampere_turns = "40 kA"
    phase = "90 deg"
    center = [0, 0, "60 mm"]
    axis = "z"
    half_window = ["60 mm", "160 mm"]
    width = "20 mm"
    height = "40 mm"
    corner = "mitred"
    [[coils]]
    name = "round"
    shape = "racetrack"
    ampere_turns = -1
    center = [0, 0, 0]
    half_window = [1, 1]
    width = 1
    height = 1
    direction = [1, 0, 0]
    axis = [0, 0, 2]
    inner_radius = 0.5
    [[coils]]
    name = "rectangle"
    shape = "rectangular"
    ampere_turns = 1
    center = [0, 0, 0]
    half_window = [1, 1]
    width = 1
    height = 1
    direction = [1, 0, 0]
    axis = "z"
    [[coils]]
    name = "circle"
    shape = "circular"
    ampere_turns = 1
    center = [0, 0, 0]
    axis = "x"
    radius = 1
    width = 1
    height = 1
    [[coils]]
    name = "winding"
    region = "winding"
    ampere_turns = 1
    terminals = ["in", "out"]
    [[coils]]
    name = "closed"
    region = "ring"
    ampere_turns = 1
    center = [0, 0, 0]
    axis = "y"
    [boundaries]
    flux_parallel = ["x_min"]
    flux_normal = ["z_min"]
    uniform_field = { surfaces = ["outer", "lid"], b = [0, 0, "1 mT"], center = [0, 0, 0] }
    [objective]
    goal = "minimise"
    kind = "uniformity"
    region = "observation"
    weighting = "volume"
    target = [0, 0, 1]
    frequency = "60 Hz"
    weight = 2
    [[constraints]]
    name = "even"
    kind = "uniformity"
    region = "observation"
    weighting = "point"
    target = [0, 0, 1]
    frequency = "60 Hz"
    upper = "4 mT2"
    [[constraints]]
    name = "integral"
    kind = "flux_density_squared"
    region = "observation"
    weighting = "volume"
    upper = "4 T2 m3"
    [[constraints]]
    kind = "field_component"
    region = "observation"
    direction = [0, 0, 1]
    upper = "5 mT"
    [[constraints]]
    kind = "loss"
    region = "plate"
    upper = "20 W"
    [[constraints]]
    kind = "energy"
    upper_ratio = 1
    [[constraints]]
    kind = "mass"
    region = "plate"
    upper = "2 kg"
    [[constraints]]
    kind = "volume"
    region = "plate"
    upper_ratio = 1.1
    [[constraints]]
    kind = "thickness"
    minimum = "1 mm"
    maximum = "10 cm"
    [design]
    surface = "plate_bottom"
    direction = [0, 0, -1]
    grid = [7, 13]
    rim = "fixed"
    lower = "-5 mm"
    upper = "20 mm"
    initial = "1 mm"
    symmetry = [{ axis = "x", at = 0 }, { axis = "y" }]
    [remesh]
    region = ["plate", "remesh"]
    poisson = 0.1
    young = 1
    force = [0, 0, 0]
    stiffness = "inverse_volume"
    motion = "along_design"
    rounds = 3
    inversion_share = 0.9
    slide = ["x_min"]
    fixed = ["y_min"]
    free = ["z_min"]
    [[remesh.subregions]]
    name = "plate"
    young = 1
    poisson = 0.3
    force = [0, 0, 0]
    [optimizer]
    algorithm = "mma"
    max_evaluations = 7
    max_time = "1 h"
    ftol_rel = 1e-3
    xtol_rel = 0
    minimum_quality = 0
    [[probes]]
    name = "here"
    points = [[0, 0, 0], ["1 mm", "2 mm", "3 mm"]]
    [output]
    directory = "runs/here"
    fields = "improved"
    mesh = false
    stl = ["plate_bottom"]
    verify_refinement = 0
    [[morph.motion]]
    design = "upper"
    "#,
    r#"
    [mesh]
    generator = "block"
    [mesh.block]
    size = ["80 mm", "80 mm", "80 mm"]
    cells = [8, 8, 8]
    [remesh]
    region = "block"
    subregions = [{ name = "block" }]
    [morph]
    increments = 4
    least_quality = 0.1
    [[morph.motion]]
    surface = "z_max"
    displacement = [0, 0, "5 mm"]
    rotation = { angle = "1 deg", axis = [0, 0, 1], center = [0, 0, 0] }
    scale = { factor = 2, center = [0, 0, 0] }
    [[morph.motion]]
    line = [[0, 0, 0], [1, 0, 0]]
    displacement = [0, 0, 1]
    [[morph.motion]]
    nodes = [[0, 0, 0]]
    displacement = [0, 0, 1]
    [[morph.motion]]
    box = [[0, 0, 0], [1, 0, 0]]
    rotation = { angle = 1 }
    [morph.tune]
    parameters = ["young", "force"]
    evaluations = 60
    log10_young = [-3, 3]
    poisson = [-0.2, 0.45]
    force = [-3, 3]
    [[morph.case]]
    name = "one"
    increments = "auto"
    least_quality = 0
    mesh.block.cells = [2, 2, 2]
    remesh.poisson = 0.1
    remesh.subregions.0.young = 5
    motion = [{ surface = "x_max", displacement = [0, 0, 1] }]
    [morph.case.paper]
    worst_quality = 0.1
    poor = 1
    share_poor_percent = 1
    share_fair_percent = 1
    share_good_percent = 1
    equations = 1
    "#,
    r#"
    [mesh]
    generator = "block"
    [analysis]
    frequencies = [0, "50 Hz"]
    [objective]
    kind = "field_component"
    region = "block"
    direction = [0, 0, 1]
    [design]
    surface = ["z_max", "x_max"]
    direction = "normal"
    filter_radius = "20 mm"
    lower = -0.005
    upper = 0.02
    initial = { random = 7 }
    [remesh]
    box = [[0, 0, 0], [1, 1, 1]]
    [[morph.case]]
    name = "up"
    motion = [{ design = ["1 mm", "2 mm"] }]
    [[morph.case]]
    name = "down"
    motion = [{ design = "lower" }]
    design.upper = "30 mm"
    design.initial.random = 5
    "#,
    r#"
    [mesh]
    generator = "boxes"
    [mesh.boxes]
    box = [[0, 0, 0], [1, 1, 1]]
    growth = 1.5
    refinement = 1
    [[mesh.boxes.regions]]
    name = "plate"
    box = [[0, 0, 0], [1, 1, 0.5]]
    size = "100 mm"
    skin = [0.1, 0.2, 0.3]
    cells = [1, 1, 1]
    [[mesh.boxes.sizes]]
    axis = "z"
    from = 0.5
    to = 0.7
    size = 0.1
    [[mesh.boxes.surfaces]]
    name = "top"
    box = [[0, 0, 0.5], [1, 1, 0.5]]
    [analysis]
    frequency = 0
    [materials.magnet]
    [regions.plate]
    material = "magnet"
    remanence = [0, 0, "1.2 T"]
    "#,
    r#"
    [mesh]
    generator = "sphere"
    [mesh.sphere]
    radius = "50 mm"
    inner_radius = "45 mm"
    outer_radius = "250 mm"
    divisions = 10
    wall_layers = 5
    air_layer = "5 mm"
    growth = 1.3
    refinement = 2
    [analysis]
    frequency = "1 kHz"
    [materials.iron]
    conductivity = "1 MS/m"
    [regions.sphere]
    material = "iron"
    model = "impedance"
    "#,
    r#"
    [mesh]
    generator = "sphere"
    [mesh.sphere]
    skin = ["1 mm", "2 mm"]
    [analysis]
    frequency = 0
    [boundaries.uniform_field]
    surfaces = "outer"
    b = [0, 0, 1]
    [objective]
    kind = "energy"
    goal = "maximise"
    "#,
    r#"
    [mesh]
    file = "device.msh"
    unit = "mm"
    [analysis]
    frequency = 50
    [[objective.terms]]
    kind = "uniformity"
    region = "gap"
    target = [0, 0, 1]
    frequency = 50
    weighting = "point"
    weight = 0.5
    [[objective.terms]]
    kind = "field_component"
    region = "gap"
    direction = [0, 0, 1]
    [[objective.terms]]
    kind = "loss"
    region = "plate"
    [[objective.terms]]
    region = "gap"
    "#,
    r#"
    [mesh]
    file = "device.msh"
    unit = "in"
    [analysis]
    frequency = "0.05 kHz"
    [design]
    surface = "pole|air"
    direction = [1, 1, 0]
    lower = "-1 mm"
    upper = "1 mm"
    initial = ["0.5 mm", 0, "-1 mm"]
    [remesh]
    region = "air"
    "#,
];

/// All valid configurations, with their names.
pub(crate) fn all() -> Vec<(String, toml::Table)> {
    let mut files: Vec<_> = std::fs::read_dir(repository("configs"))
        .expect("the folder of configurations")
        .map(|entry| entry.expect("an entry of the folder").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .collect();
    files.sort();
    let shipped = files.iter().map(|path| {
        let text = std::fs::read_to_string(path).expect("a shipped configuration");
        (path.file_name().expect("a file").to_string_lossy().into_owned(), text)
    });
    let written =
        WRITTEN.iter().enumerate().map(|(index, text)| (format!("written {index}"), (*text).to_owned()));
    let parsed = |(name, text): (String, String)| {
        Config::from_str(&text, &name).unwrap_or_else(|error| panic!("{name}: {error}"));
        let table = text.parse().unwrap_or_else(|error| panic!("{name}: {error}"));
        (name, table)
    };
    shipped.chain(written).map(parsed).collect()
}
