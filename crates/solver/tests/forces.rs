//! The force on a body that symmetry planes cut.

use std::sync::Arc;

use fluxmorph_geometry::tet4::{Point, sub};
use fluxmorph_geometry::{Mesh, RegionId};
use fluxmorph_solver::{
    Boundary, ElementFamily, FieldModelSetup, Functional, Material, Order, RigidMotion, UniformField,
};

use crate::{ALL, lines, painted, solved};

/// A quarter of two blocks above each other in a field along z, turned by an angle about the axis in which its planes meet.
fn quarter(turn: impl Fn(Point) -> Point) -> Mesh {
    let region = |[x, y, z]: Point| {
        let within = x < 0.02 && y < 0.03;
        u32::from(within && (0.01..0.02).contains(&z)) + 2 * u32::from(within && (0.03..0.05).contains(&z))
    };
    let lines = [lines(4, 0.01), lines(5, 0.01), lines(6, 0.01)];
    let upright = painted(lines, &["air", "body", "other"], region);
    let points = upright.topology().nodes().map(|n| turn(upright.point(n))).collect();
    Mesh::new(Arc::clone(upright.topology()), points).expect("a mesh")
}

fn setup((family, order): (ElementFamily, Order)) -> FieldModelSetup {
    let iron = Material { relative_permeability: 5.0, conductivity: 0.0 };
    let field = UniformField { flux_density: [0.0, 0.0, 1.0], centre: Some([0.0; 3]) };
    let boundaries = [
        ("x_min", Boundary::FluxParallel),
        ("y_min", Boundary::FluxParallel),
        ("z_min", Boundary::FluxNormal),
        ("z_max", Boundary::FluxNormal),
        ("x_max", Boundary::UniformField(field)),
        ("y_max", Boundary::UniformField(field)),
    ];
    FieldModelSetup {
        family,
        order,
        materials: vec![Material::AIR, iron, iron],
        boundaries: boundaries.map(|(name, boundary)| (name.to_owned(), boundary)).to_vec(),
        ..FieldModelSetup::default()
    }
}

#[test]
fn a_force_beside_oblique_planes_is_that_beside_upright_ones() {
    let turned = |[x, y, z]: Point| [0.8 * x - 0.6 * y, 0.6 * x + 0.8 * y, z];
    let (upright, oblique) = (quarter(|x| x), quarter(turned));
    let axes: [Point; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let motions = axes
        .map(RigidMotion::Translation)
        .into_iter()
        .chain(axes.map(|axis| RigidMotion::Rotation { axis, about: [0.0; 3] }));
    let turned_motion = |motion: RigidMotion| match motion {
        RigidMotion::Translation(along) => RigidMotion::Translation(turned(along)),
        RigidMotion::Rotation { axis, about } => {
            RigidMotion::Rotation { axis: turned(axis), about: turned(about) }
        }
    };
    for elements in ALL {
        let (before, after) = (solved(&upright, setup(elements)), solved(&oblique, setup(elements)));
        for motion in motions.clone() {
            let value = |mesh: &Mesh, (model, solution): &(_, _), motion| {
                let force = Functional::force(model, mesh, "body", &[RegionId(1)], motion).expect("free air");
                force.evaluate((model, mesh, solution)).expect("finite")
            };
            let (a, b) = (value(&upright, &before, motion), value(&oblique, &after, turned_motion(motion)));
            let largest = a.explicit.iter().flatten().flatten().fold(0.0_f64, |most, x| most.max(x.abs()));
            // Newtons of some tens, by solutions to 1e-11.
            assert!(
                (a.value - b.value).abs() < 1e-7 * (1.0 + a.value.abs()),
                "{motion:?}: {} {}",
                a.value,
                b.value
            );
            for (a, b) in a.explicit.iter().flatten().zip(b.explicit.iter().flatten()) {
                let off = sub(turned(*a), *b).map(f64::abs).into_iter().fold(0.0, f64::max);
                assert!(off < 1e-7 * largest, "{motion:?}: {a:?} {b:?}");
            }
        }
    }
}
