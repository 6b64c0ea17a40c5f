//! The exact solution against what is known by hand, and its derivatives against differences.

use fluxmorph_geometry::fem::c64;
use fluxmorph_solver::material::VACUUM_PERMEABILITY as MU;

use super::cases;
use super::derivative::Motion;
use super::exact::{Kind, Prism};

/// `∫T` of the coil [A m].
const TURNS: f64 = 2500.0 * 0.49 / 3.0;

#[track_caller]
fn close(found: c64, expected: c64) {
    // Rounding of sums over pieces.
    assert!((found / expected - 1.0).norm() < 1e-12, "{found} {expected}");
}

#[test]
fn the_constant_of_a_square_is_the_mean_of_the_source() {
    close(cases::air().constant(), c64::from(-TURNS / 4.0));
    close(cases::iron_corner(1e3).constant(), c64::from(-TURNS / 1003.0));
    close(cases::perfect_quarter().constant(), c64::from(-TURNS / 3.0));
    // Two sides of a metre.
    let skin = |depth: f64| 2.0 * depth / c64::new(1.0, 1.0);
    close(cases::impedance_quarter(0.1, 1.0).constant(), -TURNS / (3.0 + skin(0.1)));
    close(cases::impedance_quarter(0.001, 800.0).constant(), -TURNS / (3.0 + 800.0 * skin(0.001)));
    close(cases::side(0.1, 1.0).constant(), -TURNS / (3.6 + skin(0.1)));
    // 0.16 m² less, four sides of 0.4 m.
    let island = cases::island(Kind::Impedance { skin_depth: 0.01, relative_permeability: 1.0 }, "");
    close(island.constant(), -TURNS / (3.84 + 0.8 * skin(0.01)));
}

#[test]
fn fields_of_the_quarter_are_the_published_ones() {
    let at = |prism: Prism| 1e6 * prism.flux_density([-0.6, -0.6], 1.0);
    let near = |b: c64, re: f64, im: f64| assert!((b - c64::new(re, im)).norm() < 0.1, "{b}");
    near(at(cases::impedance_quarter(0.1, 1.0)), -165.3, -5.3);
    near(at(cases::impedance_quarter(0.01, 1.0)), -170.5, -0.6);
    // The corner of a meshed conductor is of the order of δ².
    near(at(cases::meshed_quarter(0.01)), -170.5, -0.6);
}

#[test]
fn the_loss_of_a_block_is_the_power_that_flows_into_it() {
    let prism = cases::impedance_quarter(0.1, 1.0);
    // ½ Re(Zs) |H|² over two square faces of 1 m by 0.1 m, Re(Zs) = 1/(σδ) = ωμδ/2.
    let resistance = 0.5 * 2.0 * std::f64::consts::PI * 50.0 * MU * 0.1;
    let hand = 0.5 * resistance * prism.constant().norm_sqr() * 0.2;
    assert!((prism.losses()[0].1 / hand - 1.0).abs() < 1e-12);
    let meshed = cases::meshed_quarter(0.01).losses()[0].1;
    // The corner again, a hundredth of the length.
    assert!((meshed / cases::impedance_quarter(0.01, 1.0).losses()[0].1 - 1.0).abs() < 0.02);
}

#[test]
fn no_flux_is_left_around_any_prism() {
    for prism in cases::all() {
        let (source, domain) = prism.fluxes();
        let c = prism.constant();
        assert!((source + domain * c).norm() < 1e-14 * source.norm(), "{}", prism.name);
        assert!(prism.observed().norm() > 0.0 && c.re < 0.0, "{}", prism.name);
    }
}

#[test]
fn derivatives_are_those_of_differences() {
    // The wall that cuts the winding sweeps T.
    let cut = Motion { axis: 0, at: 1.0, from: -1.0, to: 1.0, reach: 0.2 };
    for (prism, motion) in cases::moving().into_iter().chain([(cases::cut_coil(), cut)]) {
        let step = 1e-5;
        let [above, below] = [step, -step].map(|s| motion.applied(&prism, s));
        let difference = (above.constant() - below.constant()) / (2.0 * step);
        let exact = prism.constant_derivative(&motion);
        // Second order in a step of 1e-5 of the size, and rounding of c over the step.
        assert!((difference / exact - 1.0).norm() < 1e-8, "{}: {difference} {exact}", prism.name);
        let square = (above.square() - below.square()) / (2.0 * step);
        assert!((square / prism.square_derivative(&motion) - 1.0).abs() < 1e-8, "{}", prism.name);
    }
}
