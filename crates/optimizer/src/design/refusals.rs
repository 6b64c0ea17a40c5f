//! Designs that cannot be, and what is said of them.

use super::tests::{UP, moved_block, outward};
use super::*;

#[test]
fn designs_that_cannot_be_are_refused() {
    let mesh = moved_block(4, |x| x);
    let over = |faces: &[&str], direction| {
        let triangles: Vec<_> = faces.iter().flat_map(|face| outward(&mesh, face)).collect();
        DesignSetup { control: Control::Grid([3, 3]), ..DesignSetup::new(&triangles, direction) }
    };
    let top = || over(&["z_max"], UP);
    let mirrored = |axis, at| DesignSetup { mirrors: vec![Mirror { axis, at }], ..top() };
    for (setup, expected) in [
        (over(&[], UP), "no triangles"),
        (over(&["z_min", "z_max", "x_max"], Direction::Normal), "it turns back"),
        (over(&["x_max"], UP), "no extent along x"),
        (over(&["z_max"], Direction::Along([0.0, 0.0, 2.0])), "is 2: expected a unit vector"),
        (over(&["z_max"], Direction::Along([f64::NAN, 0.0, 1.0])), "is NaN: expected a unit vector"),
        (mirrored(7, 0.0), "one of the axes"),
        (mirrored(0, f64::NAN), "one of the axes"),
        (DesignSetup { control: Control::Filter(-1.0), ..top() }, "is -1: expected a positive length"),
        (DesignSetup { control: Control::Filter(f64::NAN), ..top() }, "expected a positive length"),
        (DesignSetup { control: Control::Grid([0, 2]), ..top() }, "is 0: expected at least 2"),
    ] {
        let error = DesignSurface::new(&mesh, &setup).expect_err("it is refused").to_string();
        assert!(error.contains(expected), "{error}");
    }
}
