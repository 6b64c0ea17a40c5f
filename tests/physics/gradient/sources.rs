//! Gradients of quadratic elements, of magnets that move with the mesh, and of devices in an applied field.

use fluxmorph_optimizer::verify::Settings;

use super::{MESHED, all_hold, brief, wavy};
use crate::problems::variables;
use crate::support::{changed, setup, setup_of};

/// Every other family and order on the quick shield, with its plate as a surface and meshed; the fewer directions the dearer.
#[test]
fn the_gradient_of_all_elements_is_exact_around_an_impedance_surface_in_a_conductor_and_for_its_loss_and_force()
 {
    let bounds = "constraints=[{ kind = \"loss\", region = \"plate\", upper_ratio = 2 }, \
                  { kind = \"force\", region = \"shield\", direction = [0, 0, 1], upper = \"1 kN\" }, \
                  { kind = \"torque\", region = \"shield\", direction = [1, 0, 0], upper = \"1 kN m\" }]";
    let body = "forces=[{ name = \"shield\", regions = [\"plate\"], about = [0, \"-20 mm\", 0] }]";
    let surface = vec!["mesh.shield.refinement=0.3", body, bounds];
    let volume =
        [&MESHED[..], &["mesh.shield.refinement=0.25", "mesh.shield.skin=[\"2 mm\"]", body, bounds]].concat();
    let penalty = [&volume[..], &["analysis.penalty=0.4"]].concat();
    for (elements, order, directions, case) in [
        ("nodal", 2, 1, &surface[..1]),
        ("nodal", 2, 1, &penalty),
        ("edge", 1, 2, &surface),
        ("edge", 2, 1, &surface),
        ("edge", 1, 2, &volume),
        ("edge", 2, 1, &volume),
    ] {
        let own = [format!("analysis.elements=\"{elements}\""), format!("analysis.order={order}")];
        let problem = setup("shield_quick.toml", &[case, &[&own[0], &own[1]]].concat()).problem;
        // Not the wavy design, where the loss hardly changes along one of the directions and the difference is all truncation.
        let p = if *case == surface { vec![2e-3; variables(&problem)] } else { wavy(&problem) };
        all_hold(&problem, &p, &Settings { directions, ..Settings::default() });
    }
}

/// A magnet above an iron plate, solved to 1e-13: at 1e-11 differences of the objective along directions in which it hardly
/// changes are the noise of the solver. The magnet's lower face moves, and the field energy of magnet and gap with it.
fn magnet(elements: &str, order: u8) -> String {
    // What nodal elements of first order carry.
    let permeability = if (elements, order) == ("nodal", 1) { 5 } else { 200 };
    format!(
        r#"
        constraints = [
            {{ kind = "energy", upper_ratio = 2 }},
            {{ kind = "energy", name = "magnet_alone", region = "magnet", upper_ratio = 2 }},
        ]
        [mesh]
        generator = "boxes"
        [mesh.boxes]
        box = [[0, 0, "-30 mm"], ["40 mm", "40 mm", "50 mm"]]
        growth = 2
        regions = [
            {{ name = "gap", box = [[0, 0, 0], ["20 mm", "20 mm", "10 mm"]], size = "5 mm" }},
            {{ name = "magnet", box = [[0, 0, "10 mm"], ["10 mm", "10 mm", "20 mm"]] }},
            {{ name = "around", box = [["10 mm", 0, "10 mm"], ["20 mm", "20 mm", "20 mm"]] }},
            {{ name = "iron", box = [[0, 0, "-10 mm"], ["20 mm", "20 mm", 0]] }},
            {{ name = "observation", box = [[0, 0, "-20 mm"], ["20 mm", "20 mm", "-10 mm"]] }},
        ]
        [analysis]
        frequency = 0
        elements = "{elements}"
        order = {order}
        linear_solver = {{ tolerance = 1e-13 }}
        [materials.iron]
        relative_permeability = {permeability}
        [materials.ferrite]
        relative_permeability = 1.05
        [regions.iron]
        material = "iron"
        [regions.magnet]
        material = "ferrite"
        remanence = ["0.1 T", 0, "0.4 T"]
        [boundaries]
        flux_parallel = ["x_max", "y_max", "z_min", "z_max"]
        [objective]
        kind = "flux_density_squared"
        weighting = "volume"
        region = "observation"
        [design]
        surface = "magnet|gap"
        direction = [0, 0, -1]
        lower = "-2 mm"
        upper = "2 mm"
        [remesh]
        region = ["magnet", "gap"]
        free = ["magnet|around", "gap|around"]
        slide = ["x_min", "y_min"]
        "#
    )
}

#[test]
fn the_gradient_with_a_magnet_that_moves_is_exact() {
    // Designs along whose directions nothing nearly cancels: the error is relative to the derivative.
    let sine = |k: usize| 4e-4 * (1.3 * k as f64).sin();
    let cosine = |k: usize| 4e-4 * (1.3 * k as f64).cos();
    for (elements, order) in [("nodal", 1), ("nodal", 2), ("edge", 1), ("edge", 2)] {
        let setup = setup_of(&magnet(elements, order));
        let count = 0..variables(&setup.problem);
        let p: Vec<f64> =
            if elements == "nodal" { count.map(sine).collect() } else { count.map(cosine).collect() };
        assert_eq!(setup.problem.constraints().len(), 2);
        all_hold(&setup.problem, &p, &brief());
    }
}

/// A block of metal in a uniform field, whose upper face moves: every kind of function of the field.
const APPLIED: &str = r#"
    constraints = [
        { kind = "field_component", region = "observation", direction = [1, 0, 2], upper_ratio = 2 },
        { kind = "energy", upper_ratio = 2 },
        { kind = "loss", region = "block", upper_ratio = 2 },
        { kind = "mass", region = "block", upper_ratio = 2 },
    ]
    [mesh]
    generator = "boxes"
    [mesh.boxes]
    box = [[0, 0, 0], ["40 mm", "40 mm", "40 mm"]]
    growth = 2
    regions = [
        { name = "around", box = [[0, 0, 0], ["15 mm", "15 mm", "15 mm"]], size = "5 mm" },
        { name = "block", box = [[0, 0, 0], ["10 mm", "10 mm", "10 mm"]] },
        { name = "observation", box = [[0, 0, "20 mm"], ["10 mm", "10 mm", "25 mm"]] },
    ]
    [analysis]
    frequency = "200 Hz"
    order = 2
    [materials.metal]
    relative_permeability = 3
    conductivity = "1e7 S/m"
    density = "7 g/cm3"
    [regions.block]
    material = "metal"
    [boundaries]
    flux_parallel = ["x_min", "y_min"]
    flux_normal = ["z_min"]
    uniform_field = { surfaces = ["x_max", "y_max", "z_max"], b = [0, 0, "0.1 T"] }
    [objective]
    kind = "target_field"
    weighting = "volume"
    region = "observation"
    target = [0, 0, "0.12 T"]
    [design]
    surface = "block|around"
    direction = "normal"
    lower = "-1 mm"
    upper = "1 mm"
    [remesh]
    region = ["block", "around"]
    slide = ["x_min", "y_min", "z_min"]
"#;

#[test]
fn the_gradient_in_an_applied_field_is_exact_for_every_kind() {
    for elements in ["order = 2", "elements = \"edge\"", "elements = \"edge\"\n    order = 2"] {
        let setup = setup_of(&changed(APPLIED, &[("order = 2", elements)]));
        let p: Vec<f64> = (0..variables(&setup.problem)).map(|k| 3e-4 * (1.3 * k as f64).sin()).collect();
        assert_eq!(setup.problem.constraints().len(), 4);
        all_hold(&setup.problem, &p, &brief());
    }
}

/// The same block beside a winding of the mesh, a bar from one flux-parallel wall to another.
#[test]
fn the_gradient_beside_a_coil_region_is_exact_for_every_kind() {
    let winding = r#"{ name = "winding", box = [["25 mm", 0, 0], ["30 mm", "40 mm", "10 mm"]] },
        { name = "observation""#;
    let walls = r#"flux_parallel = ["x_min", "x_max", "y_min", "y_max", "z_max"]
    flux_normal = ["z_min"]
    [[coils]]
    name = "bar"
    ampere_turns = "10 kA"
    region = "winding"
    terminals = ["y_min", "y_max"]"#;
    let applied = r#"flux_parallel = ["x_min", "y_min"]
    flux_normal = ["z_min"]
    uniform_field = { surfaces = ["x_max", "y_max", "z_max"], b = [0, 0, "0.1 T"] }"#;
    for elements in ["elements = \"edge\"", "elements = \"edge\"\n    order = 2"] {
        let changes = [("order = 2", elements), (r#"{ name = "observation""#, winding), (applied, walls)];
        let setup = setup_of(&changed(APPLIED, &changes));
        let p: Vec<f64> = (0..variables(&setup.problem)).map(|k| 3e-4 * (1.3 * k as f64).sin()).collect();
        all_hold(&setup.problem, &p, &brief());
    }
}
