//! What nodal elements make of meshed conductors, and what the audit expects of them before.

use fluxmorph_solver::Order;
use fluxmorph_solver::audit::{NodalErrors, skin_audit};

use super::boxed::{Cells, boxed};
use super::cases;
use super::discretisation::ALL;
use super::exact::{FREQUENCY, Prism};
use super::problem::solve;

/// Errors seen and expected of a prism whose part is a meshed conductor, in cells of 100 mm.
fn seen_and_expected(prism: &Prism, order: Order) -> (f64, f64, NodalErrors, f64) {
    let mesh = boxed(prism, Cells::COARSE);
    let block = &prism.parts[0];
    let region = mesh.topology().region(block.name).expect("a part is a region");
    let audit = skin_audit(&mesh, (region, &[region]), &block.kind.material(), FREQUENCY, order)
        .expect("it conducts");
    let nodal = ALL[usize::from(order == Order::Quadratic)];
    let seen = solve(prism, &mesh, nodal, 1.0).errors(prism);
    let expected = audit.nodal_errors(order);
    let carrying = audit.carrying_permeability();
    println!("    {:<30} {order:?} {seen:?} {expected:?} μr {carrying:.2}", prism.name);
    (seen.observed, seen.loss.expect("it conducts"), expected, carrying)
}

#[test]
fn what_nodal_elements_lose_in_meshed_conductors_is_expected() {
    let blocks = [
        cases::QUARTER,
        [[0.8, -1.0], [1.0, 1.0]],
        [[-0.4, -1.0], [1.0, -0.7]],
        [[-0.4, -1.0], [1.0, -0.9]],
        [[-0.3, -0.3], [0.1, 0.1]],
    ];
    for block in blocks {
        for depth in [1.0, 0.3, 0.1, 0.03] {
            let prism = cases::meshed(block, depth, 1.0);
            let (field, loss, expected, _) = seen_and_expected(&prism, Order::Linear);
            // A percent is theirs everywhere; factors are those of docs/verification.md. Beyond a fifth the error saturates.
            assert!(field < 2.5 * expected.field + 0.01, "{}: {field}", prism.name);
            assert!(expected.field.min(0.2) < 2.5 * field, "{}: {field}", prism.name);
            assert!(loss < 3.0 * expected.losses, "{}: {loss}", prism.name);
        }
    }
    // Of second order the field is right, and the losses of thick blocks are not.
    for (depth, most) in [(0.03, 0.05), (0.01, f64::INFINITY)] {
        let (field, loss, expected, _) =
            seen_and_expected(&cases::meshed(cases::QUARTER, depth, 1.0), Order::Quadratic);
        assert!(field < 1e-3 && loss < most && loss < 2.0 * expected.losses, "{depth} m: {field} {loss}");
    }
}

/// Iron in which eddy currents flow is iron all the same: with a skin as wide as itself as much as without.
#[test]
fn iron_loses_by_the_permeability_of_its_skin() {
    for (depth, most) in [(1.0, 0.5), (0.3, 0.2), (0.1, 0.1), (0.03, 0.04)] {
        let prism = cases::meshed(cases::QUARTER, depth, 100.0);
        let (field, _, _, carrying) = seen_and_expected(&prism, Order::Linear);
        assert!((carrying - 100.0 * depth / 2.01_f64.sqrt()).abs() < 1e-9, "{carrying}");
        assert!(field < most && field > 0.4 * most, "{depth} m: {field}");
    }
}

/// Plates and blocks of iron, free and on a wall: what nothing is said of has its losses right to a tenth. The limits are those of
/// `crates/app/build/elements.rs`: of any iron 4, of iron that currents fill 1 (10 in second order).
#[test]
fn losses_of_iron_are_right_where_nothing_is_said() {
    let blocks = [[[-0.4, -1.0], [1.0, -0.95]], [[-0.3, -0.3], [0.1, 0.1]], [[-0.3, -0.1], [0.1, 0.0]]];
    let mut said_of = Vec::new();
    for (block, permeability) in blocks.into_iter().flat_map(|block| [10.0, 100.0].map(|mu| (block, mu))) {
        for depth in [1.0, 0.3, 0.1, 0.03] {
            let prism = cases::meshed(block, depth, permeability);
            let (_, loss, expected, carrying) = seen_and_expected(&prism, Order::Linear);
            let drawn_in = carrying * (1.0 - 1.0 / permeability);
            let is_said = carrying > 4.0 || expected.losses > 0.1 || (expected.is_filled && drawn_in > 1.0);
            assert!(is_said || loss < 0.1, "{}: {loss}", prism.name);
            if is_said {
                said_of.push(loss);
            }
        }
    }
    // A warning too many is better than none; those of half of them are needed.
    let needed = said_of.iter().filter(|loss| **loss > 0.1).count();
    assert!(2 * needed >= said_of.len(), "{said_of:?}");
}

/// Of second order a free plate that carries as 1.9 has its losses right, and is silent; of one that carries as 19 it is said.
#[test]
fn losses_of_iron_of_second_order_are_right_where_nothing_is_said() {
    for (permeability, depth, within) in [(10.0, 1.0, 0.1), (10.0, 0.1, 0.1), (100.0, 1.0, 0.2)] {
        let prism = cases::meshed([[-0.3, -0.1], [0.1, 0.0]], depth, permeability);
        let (_, loss, _, carrying) = seen_and_expected(&prism, Order::Quadratic);
        assert_eq!(carrying * (1.0 - 1.0 / permeability) > 10.0, within > 0.1);
        assert!(loss < within && loss > within - 0.1, "{}: {loss}", prism.name);
    }
}
