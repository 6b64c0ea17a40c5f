//! Estimated errors of fields that are known: far from the source, behind edges at which `A` is singular.

use std::sync::Arc;

use fluxmorph_geometry::Mesh;
use fluxmorph_solver::enrichment::{Effort, Enrichment};
use fluxmorph_solver::functional::{Follow, Observed, Weighting};
use fluxmorph_solver::material::VACUUM_PERMEABILITY;
use fluxmorph_solver::{FieldModel, FieldModelSetup, Functional, SolverError};

use super::boxed::{Cells, OBSERVATION, boxed};
use super::cases;
use super::discretisation::ALL;
use super::exact::{Kind, Prism};
use super::problem::set_up;
use super::saturation::{constant, driven, steel};

/// What is asked for of a prism.
#[derive(Clone, Copy, Debug)]
enum Asked {
    /// `∫|B|²` [T² m³] over the observation.
    Square,
    /// The loss of the part `block` [W].
    Loss,
    /// The energy of everything [J], of which the winding has most of the error: in statics, without a curve, away from iron.
    Energy,
}

/// Relative errors below this are rounding and the residual that every linear solution has to reach.
const EXACT: f64 = 1e-8;

/// A prism, whether its iron follows a curve, and what is asked for.
fn devices() -> Vec<(Prism, bool, Asked)> {
    let island = Kind::Impedance { skin_depth: 0.1, relative_permeability: 1.0 };
    let of = |prism: Prism, asked| (prism, false, asked);
    vec![
        of(cases::perfect_quarter(), Asked::Square),
        of(cases::perfect_quarter(), Asked::Energy),
        of(cases::tee(), Asked::Energy),
        of(cases::iron_corner(1e3), Asked::Energy),
        of(cases::impedance_quarter(0.1, 1.0), Asked::Square),
        of(cases::impedance_quarter(0.1, 1.0), Asked::Loss),
        of(cases::island(island, "δ 0.1 m"), Asked::Loss),
        of(cases::meshed_quarter(0.1), Asked::Square),
        of(cases::meshed_quarter(0.1), Asked::Loss),
        of(cases::iron_corner(10.0), Asked::Square),
        of(cases::iron_corner(1e3), Asked::Square),
        of(cases::comb(1e3, Kind::Perfect, "perfect"), Asked::Square),
        (driven(cases::iron_far(1e3), 4e6), true, Asked::Square),
    ]
}

/// The exact value; `H = (0, 0, c)` over the observation.
fn exact(prism: &Prism, has_curve: bool, asked: Asked) -> f64 {
    let c = if has_curve { constant(prism, &steel()) } else { prism.constant().norm() };
    match asked {
        Asked::Square => (VACUUM_PERMEABILITY * c).powi(2) * prism.observation.area() * prism.height,
        Asked::Loss => prism.losses().iter().find(|(name, _)| *name == "block").expect("it conducts").1,
        // `½ ∫μ (T + c)²` with `c = −∫μT / ∫μ`.
        Asked::Energy => {
            let (flux, domain) = prism.fluxes();
            let square = VACUUM_PERMEABILITY * prism.source.square_over_all();
            0.5 * prism.height * (square - flux.norm_sqr() / domain.norm())
        }
    }
}

/// The value of a functional and its estimated error.
fn estimated(mesh: &Mesh, setup: FieldModelSetup, asked: Asked) -> Result<[f64; 2], SolverError> {
    let coarse = FieldModel::new(mesh, setup)?;
    let (state, _) = coarse.solve(mesh)?;
    let functional = match asked {
        Asked::Square => {
            let region = mesh.topology().region(OBSERVATION).expect("every mesh has it");
            let observed = Observed::Deviation { target: [0.0; 3], weighting: Weighting::Volume };
            Functional::observation(mesh, region, observed, Follow::Held)?
        }
        Asked::Loss => Functional::loss(&coarse, "block")?,
        Asked::Energy => Functional::energy(&coarse, None)?,
    };
    let fine = coarse.enriched(mesh, Effort::Any)?;
    let mut enriched = Enrichment::new(&coarse, fine, (mesh, &state), None)?;
    let at = |share| functional.evaluate((enriched.model(), mesh, &enriched.state(share)));
    let (before, half_way, after) = (at(0.0)?.value, at(0.5)?.derivative, at(1.0)?.value);
    let remainder = enriched.weigh(&coarse, &half_way)?.remainder;
    Ok([before, after - before + remainder])
}

#[test]
#[ignore = "a table of a minute"]
fn effectivities_on_prisms_are_half_to_two() {
    println!("| prism | asked | elements | tetrahedra | exact | first order | η | effectivity |");
    println!("|---|---|---|---|---|---|---|---|");
    let mut count = 0;
    for (prism, has_curve, asked) in devices() {
        let exact = exact(&prism, has_curve, asked);
        for cells in [Cells::COARSE, Cells::FINE] {
            let (mesh, mut setup) = set_up(&prism, &boxed(&prism, cells), 1.0);
            if has_curve {
                let iron = mesh.topology().region("iron").expect("it is named");
                setup.bh = vec![None; iron.index()];
                setup.bh.push(Some(Arc::new(steel())));
            }
            for discretisation in ALL.into_iter().filter(|d| d.name.ends_with('1')) {
                let tets = mesh.topology().tets().len();
                let head = format!("| {} | {asked:?} | {} | {tets} ", prism.name, discretisation.name);
                match estimated(&mesh, discretisation.of(setup.clone()), asked) {
                    Ok([value, error]) if (value - exact).abs() < EXACT * exact => {
                        println!("{head}| {exact:.5e} | exact | {error:+.0e} | |");
                        assert!(error.abs() < EXACT * exact, "{error:e} of {exact:e}");
                    }
                    Ok([value, error]) => {
                        let effectivity = error / (exact - value);
                        println!("{head}| {exact:.5e} | {value:.5e} | {error:+.3e} | {effectivity:.2} |");
                        assert!((0.5..=2.0).contains(&effectivity), "{effectivity}");
                        count += 1;
                    }
                    Err(cause) => println!("{head}| refused: {cause} | | | |"),
                }
            }
        }
    }
    assert!(count >= 20, "{count}");
}
