//! A winding inside iron that closes around it, as of a transformer without a load: the iron carries thousands of times the flux that
//! the current has in air, and what is left of the solver's residual is rounding.
//!
//! A bar with the current `I` through a slab of iron, one cell of a row that goes on at both sides: `H = I/(2w)` in the iron above and
//! below, of the thickness `t`, and falls to zero in the middle of the bar of the height `2h`. The flux linkage of a bar of the
//! length `l` is `l (B(H) t + μ0 H h/3)`.

use fluxmorph_optimizer::problem::{Analysis, Derivatives, NoProgress, SolverCache};
use fluxmorph_solver::material::VACUUM_PERMEABILITY;

use crate::problems::variables;
use crate::support::folder::{number, read_json};
use crate::support::program::{command, finish, folder};
use crate::support::{relative_difference, setup_of};

/// [m]
const WIDTH: f64 = 0.02;
const LENGTH: f64 = 0.02;
const HALF_HEIGHT: f64 = 0.01;
const THICKNESS: f64 = 0.05;

/// The cell; `iron` is what the material is.
fn device(iron: &str, frequency: f64, more: &str) -> String {
    format!(
        r#"
        [mesh]
        generator = "boxes"
        [mesh.boxes]
        box = [[0, 0, "-60 mm"], ["20 mm", "20 mm", "60 mm"]]
        growth = 2
        regions = [
            {{ name = "iron", box = [[0, 0, "-60 mm"], ["20 mm", "20 mm", "60 mm"]] }},
            {{ name = "other", box = [[0, 0, "20 mm"], ["20 mm", "20 mm", "40 mm"]], size = "5 mm" }},
            {{ name = "winding", box = [[0, 0, "-10 mm"], ["20 mm", "20 mm", "10 mm"]], size = "2 mm" }},
        ]
        [analysis]
        elements = "edge"
        frequency = {frequency}
        [materials.iron]
        {iron}
        [regions.iron]
        material = "iron"
        [regions.other]
        material = "iron"
        [[coils]]
        name = "bar"
        turns = 1
        ampere_turns = "10 A"
        region = "winding"
        terminals = ["y_min", "y_max"]
        [boundaries]
        flux_parallel = ["y_min", "y_max", "z_min", "z_max"]
        flux_normal = ["x_min", "x_max"]
        {more}"#
    )
}

/// Of `B` [T] in the iron.
fn flux_linkage(flux_density: f64) -> f64 {
    let in_air = VACUUM_PERMEABILITY * 10.0 / (2.0 * WIDTH) * HALF_HEIGHT / 3.0;
    LENGTH * (flux_density * THICKNESS + in_air)
}

/// A steel of which 250 A/m make 1.5 T.
const CURVE: &str = "bh = [[5, 0.05], [20, 0.4], [50, 1.2], [250, 1.5], [1000, 1.7], [1e5, 2.1]]";

#[test]
fn the_flux_linkage_of_a_winding_in_closed_iron_is_exact() {
    for (iron, frequency, flux_density) in [
        ("relative_permeability = 1e5", 0.0, 1e5 * VACUUM_PERMEABILITY * 250.0),
        (CURVE, 0.0, 1.5),
        (CURVE, 50.0, 1.5),
    ] {
        let home = folder();
        let (config, out) = (home.path().join("core.toml"), home.path().join("out"));
        std::fs::write(&config, device(iron, frequency, "")).expect("written");
        finish(command(&[&"solve", &config, &"--out", &out]).args(["--set", "accuracy.estimate=false"]))
            .completed();
        let result = read_json(&out.join("result.json"));
        let residual = number(&result, "/linear_solver/worst_residual");
        let path = if frequency == 0.0 { "/coils/0/flux_linkage_wb" } else { "/coils/0/flux_linkage_wb/0" };
        let (found, exact) = (number(&result, path), flux_linkage(flux_density));
        println!("{iron}, {frequency} Hz: {found:.7e} Wb, exact {exact:.7e} Wb, residual {residual:.1e}");
        assert!((found / exact - 1.0).abs() < 1e-6, "{found} {exact}");
        // Less is not to be had in double precision, and more than a linear system elsewhere is solved to.
        assert!(residual > 1e-9, "{residual:e}: the test says nothing");
    }
}

/// Without eddy currents the phasor of a field along one line is the field at rest of its amplitude, and so is its derivative.
#[test]
fn the_gradient_of_a_flux_linkage_in_closed_iron_is_that_at_rest() {
    let other = "bh = [[5, 0.02], [20, 0.1], [50, 0.3], [250, 0.7], [1000, 1.2], [1e5, 2.0]]";
    let more = format!(
        "[materials.other]\n{other}\n[objective]\nkind = \"flux_linkage\"\ncoils = [\"bar\"]\n[design]\n\
         surface = \"iron|other\"\ndirection = [0, 0, 1]\nlower = \"-3 mm\"\nupper = \"3 mm\"\n[remesh]\n\
         region = [\"iron\", \"other\"]\nslide = [\"x_min\", \"x_max\", \"y_min\", \"y_max\"]\n"
    );
    let evaluated = |frequency: f64| -> Analysis {
        let text = device(CURVE, frequency, &more).replace(
            "[regions.other]\n        material = \"iron\"",
            "[regions.other]\n        material = \"other\"",
        );
        let problem = setup_of(&text).problem;
        let p: Vec<f64> = (0..variables(&problem)).map(|k| 5e-4 * (k as f64).sin()).collect();
        problem
            .evaluate(&p, Derivatives::First, &mut SolverCache::default(), &mut NoProgress)
            .unwrap_or_else(|e| panic!("{frequency} Hz: {e}"))
    };
    let [at_rest, phasor] = [0.0, 50.0].map(evaluated);
    let objective = |analysis: &Analysis| analysis.objective.expect("an objective");
    assert!((objective(&phasor) / objective(&at_rest) - 1.0).abs() < 1e-8);
    let gradient = |analysis: &Analysis| analysis.gradient.clone().expect("asked for");
    let difference = relative_difference(&gradient(&phasor), &gradient(&at_rest));
    println!("residuals {:.1e} and {:.1e}: {difference:.1e}", at_rest.worst_residual, phasor.worst_residual);
    assert!(difference < 1e-6, "{difference:e}");
}
