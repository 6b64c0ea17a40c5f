//! Solid conductors and voltages beside iron that saturates, above 0 Hz: against the linear material, given currents, and differences.

use std::sync::Arc;

use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::fem::c64;
use fluxmorph_solver::circuit::terminals;
use fluxmorph_solver::functional::AtTerminals;
use fluxmorph_solver::{
    BhCurve, ElementFamily, FieldModel, FieldModelSetup, FieldSolution, Functional, Material, Order, Winding,
};

use super::{bar_in_a_box, setup_with_a_bar, sway};
use crate::saturation::{law, straight};
use crate::{ALL, NO_CIRCUIT, derivatives_match};

/// Hz.
const FREQUENCY: f64 = 300.0;

const IRON: Material = Material { relative_permeability: 2000.0, conductivity: 5e5 };

/// What is in series with the bar and the winding.
const SERIES: [Winding; 2] = [
    Winding { resistance: 1e-5, series_inductance: 1e-8, ..NO_CIRCUIT },
    Winding { turns: 20.0, resistance: 0.05, ..NO_CIRCUIT },
];

/// The bar and the winding with their currents [A], or with these voltages [V], beside the plate of iron.
fn setup(
    mesh: &Mesh,
    elements: (ElementFamily, Order),
    (iron, curve): (Material, Option<BhCurve>),
    (currents, voltages): ([c64; 2], [Option<c64>; 2]),
) -> FieldModelSetup {
    let mut setup = setup_with_a_bar(mesh, elements, FREQUENCY, (0.0, NO_CIRCUIT));
    setup.materials[2] = iron;
    setup.bh = vec![None, None, curve.map(Arc::new)];
    for k in 0..2 {
        setup.coils[k].ampere_turns = SERIES[k].turns * currents[k];
        setup.windings[k] = Some(Winding { voltage: voltages[k], ..SERIES[k] });
    }
    setup
}

/// Of two phases [A]; the plate is short, and saturates late.
const CURRENTS: [c64; 2] = [c64::new(240e3, 0.0), c64::new(-3600.0, 2400.0)];

/// The voltages [V] of sources with which the bar and the winding have their currents in a state.
fn voltages(model: &FieldModel, mesh: &Mesh, state: &FieldSolution) -> [c64; 2] {
    let seen = terminals((model, mesh, state)).expect("terminals");
    [0, 1].map(|k| {
        let beyond = SERIES[k].impedance(model.angular_frequency()) - SERIES[k].resistance;
        seen.coils[k].voltage + beyond * seen.coils[k].current
    })
}

#[test]
fn a_straight_table_beside_circuits_is_the_linear_material() {
    let mesh = bar_in_a_box();
    let straight = straight(IRON);
    let sources = [
        ([CURRENTS[0] * 1e-4, CURRENTS[1] * 1e-4], [None; 2]),
        ([c64::default(); 2], [Some(c64::new(1e-3, 2e-3)), Some(c64::new(0.02, 0.0))]),
    ];
    for elements in ALL {
        for sources in &sources {
            let seen = [None, Some(straight.clone())].map(|curve| {
                let (model, state) = crate::solved(&mesh, setup(&mesh, elements, (IRON, curve), *sources));
                terminals((&model, &mesh, &state)).expect("terminals").coils
            });
            for (a, b) in seen[0].iter().zip(&seen[1]) {
                println!("{elements:?}: {a:?}");
                for (a, b) in [(a.current, b.current), (a.flux_linkage, b.flux_linkage)] {
                    assert!((a - b).norm() < 1e-9 * a.norm(), "{elements:?}: {a} {b}");
                }
            }
        }
    }
}

/// Of a short circuit nothing is left but what cancels: as beside the linear material, and beside saturated iron.
#[test]
fn what_is_short_circuited_beside_a_curve_has_a_state() {
    let mesh = bar_in_a_box();
    let straight = straight(IRON);
    for (shorted, share) in [(0, 1e-4), (1, 1e-4), (0, 1.0), (1, 1.0)] {
        let mut currents = CURRENTS.map(|current| share * current);
        currents[shorted] = c64::default();
        let law = if share < 1.0 { straight.clone() } else { law() };
        let seen = [None, Some(law)].map(|curve| {
            let mut setup = setup(&mesh, ALL[2], (IRON, curve), (currents, [None; 2]));
            let turns = SERIES[shorted].turns;
            setup.windings[shorted] = Some(Winding { turns, voltage: Some(c64::default()), ..NO_CIRCUIT });
            let (model, state) = crate::solved(&mesh, setup);
            println!("{shorted}: {} steps, {:.1e}", state.newton_steps(), state.report().residual);
            assert!(state.report().residual < 1e-10);
            terminals((&model, &mesh, &state)).expect("terminals").coils
        });
        let [linear, curved] = [&seen[0], &seen[1]].map(|coils| coils[shorted].current);
        let off = (linear - curved).norm() / linear.norm();
        assert!(if share < 1.0 { off < 1e-9 } else { off > 1e-6 }, "{shorted}: {linear} {curved}");
    }
}

#[test]
fn voltages_drive_the_currents_that_need_them_beside_saturated_iron() {
    let mesh = bar_in_a_box();
    let topology = mesh.topology();
    let plate = topology.elements_of(topology.region("plate").expect("a region"));
    for elements in ALL {
        let of = |sources| crate::solved(&mesh, setup(&mesh, elements, (IRON, Some(law())), sources));
        let (given, state) = of((CURRENTS, [None; 2]));
        let most = |b: &[c64; 3]| b.iter().map(|c| c.norm_sqr()).sum::<f64>().sqrt();
        let densities = state.flux_densities_of(&given, &mesh, &plate);
        let most = densities.iter().map(most).fold(0.0, f64::max);
        let needed = voltages(&given, &mesh, &state);
        let losses: f64 = state.losses(&given, &mesh).iter().map(|(_, loss)| loss).sum();
        println!(
            "{elements:?}: up to {most:.2} T, {losses:.1} W, {needed:?} V, {} steps",
            state.newton_steps()
        );
        assert!(most > 1.8, "it saturates");
        let mixed = [[true, true], [true, false], [false, true]];
        let cases = if elements.1 == Order::Linear { &mixed[..] } else { &mixed[..1] };
        for driven in cases {
            let currents = std::array::from_fn(|k| if driven[k] { c64::default() } else { CURRENTS[k] });
            let sources = std::array::from_fn(|k| driven[k].then_some(needed[k]));
            let (model, state) = of((currents, sources));
            let seen = terminals((&model, &mesh, &state)).expect("terminals");
            for (coil, current) in seen.coils.iter().zip(CURRENTS) {
                let off = (coil.current - current).norm() / current.norm();
                println!("  {driven:?} {}: {off:.1e}, {} steps", coil.name, state.newton_steps());
                assert!(off < 1e-8, "{elements:?} {driven:?}: {} for {current}", coil.current);
            }
        }
    }
}

/// At, below and above resonance, where the residual measures no error of the field: Newton's steps are held against what they ask for.
#[test]
fn a_capacitance_in_series_beside_saturated_iron_has_a_state() {
    let mesh = bar_in_a_box();
    let of = |setup| crate::solved(&mesh, setup);
    let iron = (IRON, Some(law()));
    let (given, state) = of(setup(&mesh, ALL[2], iron.clone(), (CURRENTS, [None; 2])));
    let seen = &terminals((&given, &mesh, &state)).expect("terminals").coils[1];
    let omega = given.angular_frequency();
    let reactance = omega * (seen.flux_linkage / seen.current).re;
    for share in [0.3, 0.9, 1.0, 1.1, 3.0] {
        let capacitance = 1.0 / (omega * share * reactance);
        let voltage = seen.voltage + c64::new(0.0, -share * reactance) * seen.current;
        let mut driven = setup(&mesh, ALL[2], iron.clone(), ([CURRENTS[0], c64::default()], [None; 2]));
        let series = Winding { series_capacitance: Some(capacitance), ..SERIES[1] };
        driven.windings[1] = Some(Winding { voltage: Some(voltage), ..series });
        let (model, state) = of(driven);
        let found = &terminals((&model, &mesh, &state)).expect("terminals").coils[1];
        let source = found.voltage + (series.impedance(omega) - series.resistance) * found.current;
        println!("{share}: {} steps, {} for {} A", state.newton_steps(), found.current, seen.current);
        assert!(
            state.report().residual < 1e-10 && (source / voltage - 1.0).norm() < 1e-8,
            "{share}: {source} {voltage}"
        );
    }
}

#[test]
fn derivatives_of_what_voltages_drive_beside_saturated_iron_match_differences() {
    let mesh = bar_in_a_box();
    let (moving, direction) = sway(&mesh);
    for elements in [ALL[0], ALL[2]] {
        let of = |sources| crate::solved(&mesh, setup(&mesh, elements, (IRON, Some(law())), sources));
        let (given, state) = of((CURRENTS, [None; 2]));
        let needed = voltages(&given, &mesh, &state);
        for sources in [(CURRENTS, [None; 2]), ([c64::default(); 2], needed.map(Some))] {
            let is_driven = sources.1[0].is_some();
            let (model, _) = of(sources);
            let mut functionals = vec![
                Functional::loss(&model, "bar").expect("it conducts"),
                Functional::loss(&model, "plate").expect("it conducts"),
                Functional::at_terminals(&model, "bar", AtTerminals::Power).expect("a winding"),
                Functional::at_terminals(&model, "winding", AtTerminals::FluxLinkage).expect("a winding"),
                Functional::at_terminals(&model, "bar", AtTerminals::Voltage).expect("a winding"),
                Functional::energy(&model, None).expect("a model"),
            ];
            if is_driven {
                functionals.push(
                    Functional::at_terminals(&model, "winding", AtTerminals::Current).expect("a winding"),
                );
            }
            derivatives_match(&model, &mesh, &functionals, (&moving, &direction, 1e-6));
        }
    }
}
