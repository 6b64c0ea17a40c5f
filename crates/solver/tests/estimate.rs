//! The estimated error of a functional against the error itself: on prisms with a singular edge, whose field is known
//! (`prisms`), and around iron, against second order on halved edges.

use std::sync::Arc;

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::refine::{RefineLimits, uniform};
use fluxmorph_geometry::{Mesh, RegionId};
use fluxmorph_solver::enrichment::{Effort, Enrichment};
use fluxmorph_solver::{
    BhCurve, Conductor, ElementFamily, FieldModel, FieldModelSetup, Functional, Material, Order, SurfaceLaw,
};

use crate::{in_the_square, solved, square};

/// The value of a functional, its estimated error, and what all elements add to that.
pub(crate) fn estimate(mesh: &Mesh, setup: &FieldModelSetup, functional: &Functional) -> [f64; 3] {
    let (coarse, state) = solved(mesh, setup.clone());
    let value = functional.evaluate((&coarse, mesh, &state)).expect("a number").value;
    let fine = coarse.enriched(mesh, Effort::Any).expect("a sound problem");
    let mut enriched = Enrichment::new(&coarse, fine, (mesh, &state), None).expect("it converges");
    let at = |enriched: &Enrichment, share: f64| {
        functional.evaluate((enriched.model(), mesh, &enriched.state(share))).expect("a number")
    };
    let [before, half_way, after] = [0.0, 0.5, 1.0].map(|share| at(&enriched, share));
    // The same function of the same field: quadrature and rounding alone.
    assert!((before.value - value).abs() < 1e-9 * value.abs(), "{} {value}", before.value);
    let weighed = enriched.weigh(&coarse, &half_way.derivative).expect("it converges");
    let error = after.value - before.value + weighed.remainder;
    println!("{} iterations for both corrections", enriched.iterations());
    [value, error, weighed.by_element.iter().sum()]
}

pub(crate) fn value(mesh: &Mesh, setup: &FieldModelSetup, functional: &Functional) -> f64 {
    let (model, state) = solved(mesh, setup.clone());
    functional.evaluate((&model, mesh, &state)).expect("a number").value
}

/// Effectivity between one half and two, and what elements add makes up the whole.
fn assert_effective(what: &str, [value, estimated, sum]: [f64; 3], exact: f64) {
    let effectivity = estimated / (exact - value);
    println!("{what}: error {:+.2e} of {exact:.4e}, effectivity {effectivity:.2}", exact - value);
    assert!((0.5..2.0).contains(&effectivity), "{what}: {effectivity}");
    assert!((sum - estimated).abs() < 0.1 * estimated.abs(), "{what}: {sum:e} {estimated:e}");
}

/// The wall's term has another coefficient in second order: the estimate would be a seventeenth of the error.
#[test]
fn nodal_elements_at_a_singular_edge_have_no_estimate_and_say_so() {
    let (mesh, exposed) = square().without_region(RegionId(1)).expect("what is left");
    let conductor = Conductor { name: "block".to_owned(), surface: exposed, law: SurfaceLaw::Perfect };
    for frequency in [0.0, 50.0] {
        let setup = FieldModelSetup {
            conductors: vec![conductor.clone()],
            ..in_the_square((ElementFamily::Nodal, Order::Linear), frequency)
        };
        let model = FieldModel::new(&mesh, setup).expect("a sound problem");
        let error = model.enriched(&mesh, Effort::Any).expect_err("no estimate").to_string();
        assert!(error.contains("re-entrant edge") && error.contains("edge elements"), "{error}");
    }
}

/// Iron that saturates: the error that is left is that of a nonlinear field.
#[test]
fn the_error_of_saturated_iron_is_estimated() {
    let mesh = square();
    let point = |i: i32| {
        let h = 20.0 * (1.3_f64.powi(i) - 1.0);
        [h, 4e-7 * std::f64::consts::PI * h + 0.002 * (1.0 - (-h / 100.0).exp())]
    };
    let law = Arc::new(BhCurve::new(&(0..32).map(point).collect::<Vec<_>>()).expect("a sound table"));
    let iron = Material { relative_permeability: 10.0, conductivity: 0.0 };
    // Below the knee, across it, and beyond.
    for ampere_turns in [30.0, 1e3, 3e4] {
        let of = |order| {
            let mut setup = in_the_square((ElementFamily::Edge, order), 0.0);
            setup.coils[0].ampere_turns = c64::new(ampere_turns, 0.0);
            setup.materials[1] = iron;
            FieldModelSetup { bh: vec![None, Some(Arc::clone(&law))], ..setup }
        };
        let model = FieldModel::new(&mesh, of(Order::Linear)).expect("a sound problem");
        let energy = Functional::energy(&model, None).expect("a functional");
        let found = estimate(&mesh, &of(Order::Linear), &energy);
        let difference = value(&mesh, &of(Order::Quadratic), &energy) - found[0];
        println!("F {:.5e}, estimated {:.5e}, second order has {difference:.5e} more", found[0], found[1]);
        // The definition: what is left of the residual is weighed.
        assert!((found[1] - difference).abs() < 0.02 * difference.abs(), "{} {difference}", found[1]);
    }
}

#[test]
fn the_error_around_iron_is_estimated_for_both_families() {
    around_iron(0.0, 0.0);
}

#[test]
#[ignore = "a minute: eddy currents of second order on halved edges"]
fn so_is_that_around_iron_with_eddy_currents() {
    around_iron(5.0, 1e4);
}

/// A block of iron in the quarter at a frequency [Hz] and of a conductivity [S/m]: what is between first order and the truth.
fn around_iron(frequency: f64, conductivity: f64) {
    let mesh = square();
    let fine = uniform(&mesh, RefineLimits::default()).expect("eight for each");
    let iron = Material { relative_permeability: 20.0, conductivity };
    let of = |family, order| FieldModelSetup {
        materials: vec![Material::AIR, iron, Material::AIR],
        ..in_the_square((family, order), frequency)
    };
    // The field is one, whatever the elements.
    let best = of(ElementFamily::Edge, Order::Quadratic);
    let on_fine = FieldModel::new(fine.mesh(), best.clone()).expect("a sound problem");
    let energy = Functional::energy(&on_fine, None).expect("a functional");
    let reference = value(fine.mesh(), &best, &energy);
    for family in [ElementFamily::Edge, ElementFamily::Nodal] {
        let of = |order| of(family, order);
        let model = FieldModel::new(&mesh, of(Order::Linear)).expect("a sound problem");
        let energy = Functional::energy(&model, None).expect("a functional");
        let found = estimate(&mesh, &of(Order::Linear), &energy);
        // The definition: second order on the same mesh, whatever that is worth.
        let second = value(&mesh, &of(Order::Quadratic), &energy);
        let difference = second - found[0];
        assert!((found[1] - difference).abs() < 0.02 * difference.abs(), "{} {difference}", found[1]);
        assert_effective(&format!("{family:?}, {frequency} Hz"), found, reference);
    }
}

#[test]
fn second_order_has_no_estimate_and_says_so() {
    let mesh = square();
    let setup = in_the_square((ElementFamily::Edge, Order::Quadratic), 0.0);
    let model = FieldModel::new(&mesh, setup).expect("a sound problem");
    let error = model.enriched(&mesh, Effort::Any).expect_err("there is no third order");
    assert!(error.to_string().contains("first order"), "{error}");
}
