//! The field at points at the symmetry planes of a part of a device.

use std::collections::HashMap;
use std::sync::Arc;

use fluxmorph_geometry::locate::locate;
use fluxmorph_geometry::tet4::{Point, dot, sub};
use fluxmorph_geometry::{Mesh, NodeId, RegionId, Topology};
use fluxmorph_solver::element::Complex3;
use fluxmorph_solver::functional::{Compared, Follow, Observed, Weighting};
use fluxmorph_solver::recovery::{RecoveredPoint, probe};
use fluxmorph_solver::{
    Boundary, ElementFamily, FieldModel, FieldModelSetup, Functional, Material, Order, UniformField,
};

use crate::{ALL, OUTSIDE, lines, painted, solved};

/// Half of a block in a box, cut at x = 0: x_min is a plane without flux across, z_min and z_max are crossed at right angles.
fn half() -> Mesh {
    let block = |x: Point| u32::from(x[0] < 0.02 && (0.02..0.04).contains(&x[1]) && x[2] < 0.02);
    painted([lines(4, 0.01), lines(6, 0.01), lines(4, 0.01)], &["air", "block"], block)
}

/// A magnetic block in a field along z that is given on the sides in `applied`, at rest.
fn setup((family, order): (ElementFamily, Order), parallel: &[&str], applied: &[&str]) -> FieldModelSetup {
    let block = Material { relative_permeability: 4.0, conductivity: 0.0 };
    let field = Boundary::UniformField(UniformField { flux_density: [0.0, 0.0, 1.0], centre: None });
    let of = |names: &[&str], boundary: Boundary| -> Vec<(String, Boundary)> {
        names.iter().map(|name| ((*name).to_owned(), boundary)).collect()
    };
    let mut boundaries = of(parallel, Boundary::FluxParallel);
    boundaries.extend(of(&["z_min", "z_max"], Boundary::FluxNormal));
    boundaries.extend(of(applied, field));
    FieldModelSetup {
        family,
        order,
        materials: vec![Material::AIR, block],
        boundaries,
        ..FieldModelSetup::default()
    }
}

fn recovered(mesh: &Mesh, setup: FieldModelSetup, points: &[Point]) -> Vec<Complex3> {
    let (model, solution) = solved(mesh, setup);
    probe((&model, mesh, &solution), "points", points).expect("points of the mesh")
}

const HALF: [&str; 3] = ["x_max", "y_min", "y_max"];

/// Beside the block and behind it, on both planes and off them.
const POINTS: [Point; 6] = [
    [0.0, 0.013, 0.0],
    [0.0, 0.016, 0.007],
    [0.0, 0.027, 0.026],
    [0.003, 0.016, 0.0],
    [0.027, 0.031, 0.0],
    [0.002, 0.012, 0.003],
];

/// A mesh with its mirror image beyond the plane through zero at right angles to an axis; a side there is the image of the other one.
fn doubled(half: &Mesh, axis: usize) -> Mesh {
    let topology = half.topology();
    let mut points: Vec<Point> = topology.nodes().map(|n| half.point(n)).collect();
    let mut image = HashMap::new();
    for n in topology.nodes() {
        let mut place = half.point(n);
        let beyond = if place[axis] == 0.0 { n } else { NodeId::new(points.len()) };
        if place[axis] != 0.0 {
            place[axis] *= -1.0;
            points.push(place);
        }
        image.insert(n, beyond);
    }
    // With two nodes exchanged, the volume keeps its sign.
    let turned = |t: &[NodeId; 4]| [image[&t[1]], image[&t[0]], image[&t[2]], image[&t[3]]];
    let tets = topology.tets().iter().copied().chain(topology.tets().iter().map(turned)).collect();
    let regions: Vec<RegionId> = [topology.region_of(), topology.region_of()].concat();
    let mut all =
        Topology::new(points.len(), tets, topology.region_names().to_vec(), regions).expect("it conforms");
    for (k, name) in OUTSIDE.into_iter().enumerate() {
        let of = |name: &str| topology.surface(name).expect("a side").to_vec();
        let mirrored = |name: &str| of(name).into_iter().map(|t| t.map(|n| image[&n])).collect();
        let side = match k {
            _ if k == 2 * axis => mirrored(OUTSIDE[k + 1]),
            _ if k == 2 * axis + 1 => of(name),
            _ => [of(name), mirrored(name)].concat(),
        };
        all = all.with_surface(name, side).expect("known nodes");
    }
    Mesh::new(Arc::new(all), points).expect("a mesh")
}

/// At a flux-parallel plane, and at a flux-normal one: with a block that is magnetic, one that eddy currents flow in, and a magnet
/// of which the image is itself.
#[test]
fn half_of_a_device_has_the_values_of_the_whole_at_every_point() {
    let half = half();
    let wholes =
        [(doubled(&half, 0), &[][..], &OUTSIDE[..4]), (doubled(&half, 2), &["x_min"][..], &HALF[..])];
    let magnetic = |_: &mut FieldModelSetup| ();
    let conducting = |setup: &mut FieldModelSetup| {
        // A skin of 8 mm.
        (setup.frequency, setup.materials[1].conductivity) = (1000.0, 1e6);
    };
    let magnet = |setup: &mut FieldModelSetup| setup.remanence = vec![[0.0; 3], [0.0, 0.0, 1.5]];
    let blocks: [&dyn Fn(&mut FieldModelSetup); 3] = [&magnetic, &conducting, &magnet];
    for (elements, (kind, with_block)) in ALL.into_iter().flat_map(|e| (0..).zip(blocks).map(move |b| (e, b)))
    {
        let values = |mesh: &Mesh, parallel: &[&str], applied: &[&str]| {
            let mut setup = setup(elements, parallel, applied);
            with_block(&mut setup);
            recovered(mesh, setup, &POINTS)
        };
        let part = values(&half, &["x_min"], &HALF);
        for (axis, (whole, parallel, applied)) in wholes.iter().enumerate() {
            let all = values(whole, parallel, applied);
            for ((part, all), place) in part.iter().zip(&all).zip(POINTS) {
                let off = (0..3).map(|d| (part[d] - all[d]).norm()).fold(0.0, f64::max);
                // Fields of order 1, by solutions to 1e-11.
                assert!(off < 1e-8, "{elements:?} {kind} {axis} {place:?}: {part:?} {all:?}");
            }
        }
    }
}

/// Half of a block in a box that leans on the plane x = 0, and one that stands on z = 0, neither in the middle along y: the mean of the
/// whole has nothing across the first plane and along the second, where that of the part has something.
#[test]
fn half_of_a_device_has_the_homogeneity_of_the_whole() {
    let of_block = |x: [f64; 2], z: [f64; 2]| {
        let within = |value: f64, [from, to]: [f64; 2]| (from..to).contains(&value);
        let block = |p: Point| u32::from(within(p[0], x) && within(p[1], [0.01, 0.03]) && within(p[2], z));
        painted([lines(4, 0.01), lines(6, 0.01), lines(4, 0.01)], &["air", "block"], block)
    };
    let cases: [(Mesh, usize, &[&str], &[&str]); 2] = [
        (of_block([0.0, 0.02], [0.01, 0.03]), 0, &[], &OUTSIDE[..4]),
        (of_block([0.01, 0.03], [0.0, 0.02]), 2, &["x_min"], &HALF),
    ];
    for (half, axis, parallel, applied) in cases {
        let whole = doubled(&half, axis);
        for of in [Compared::Vector, Compared::Modulus] {
            for weighting in [Weighting::Volume, Weighting::Point] {
                let figures = |mesh: &Mesh, parallel: &[&str], applied: &[&str]| {
                    let (model, solution) = solved(mesh, setup(ALL[2], parallel, applied));
                    let observed = Observed::Homogeneity { of, weighting };
                    let block = Functional::observation(mesh, RegionId(1), observed, Follow::Held);
                    let block = block.expect("a region with elements");
                    let value = block.evaluate((&model, mesh, &solution)).expect("finite").value;
                    let quality = block.field_quality((&model, mesh, &solution)).expect("its figures");
                    [value, quality.mean, quality.peak_to_peak]
                };
                let part = figures(&half, &["x_min"], &HALF);
                let all = figures(&whole, parallel, applied);
                let off = (0..3).map(|k| (part[k] / all[k] - 1.0).abs()).fold(0.0, f64::max);
                // By solutions to 1e-11.
                assert!(part[0] > 1e-3 && off < 1e-8, "{axis} {of:?} {weighting:?}: {part:?} {all:?}");
            }
        }
    }
}

/// The image of a magnet that points across a flux-parallel plane would point back: a patch in it ends there, as at a natural face.
#[test]
fn a_magnet_across_a_plane_has_no_image() {
    let half = half();
    let in_the_block = [0.0, 0.031, 0.003];
    let (e, _) = locate(&half, &[in_the_block])[0].expect("a point of the block");
    for elements in ALL {
        let weights = |remanence: Point, parallel: &[&str]| {
            let mut setup = setup(elements, parallel, &HALF);
            setup.remanence = vec![[0.0; 3], remanence];
            let model = FieldModel::new(&half, setup).expect("a sound problem");
            format!("{:?}", RecoveredPoint::new(&model, &half, e, in_the_block))
        };
        let alone = weights([1.5, 0.0, 0.0], &["x_min"]);
        assert_eq!(alone, weights([1.5, 0.0, 0.0], &[]), "{elements:?}");
        assert_ne!(alone, weights([0.0, 0.0, 1.5], &["x_min"]), "{elements:?}");
    }
}

#[test]
fn a_device_that_is_turned_has_the_same_values() {
    let upright = half();
    let turned = |[x, y, z]: Point| {
        let (x, y) = (0.8 * x - 0.6 * y, 0.6 * x + 0.8 * y);
        [x, 0.8 * y - 0.6 * z, 0.6 * y + 0.8 * z]
    };
    let back =
        |v: Point| [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|axis| dot(v, turned(axis)));
    let points = upright.topology().nodes().map(|n| turned(upright.point(n))).collect();
    let leaning = Mesh::new(Arc::clone(upright.topology()), points).expect("a mesh");
    for elements in ALL {
        let setup = setup(elements, &["x_min"], &HALF);
        let mut turned_setup = setup.clone();
        for (_, boundary) in &mut turned_setup.boundaries {
            if let Boundary::UniformField(field) = boundary {
                field.flux_density = turned(field.flux_density);
            }
        }
        let before = recovered(&upright, setup, &POINTS);
        let after = recovered(&leaning, turned_setup, &POINTS.map(turned));
        for ((before, after), place) in before.iter().zip(&after).zip(POINTS) {
            let off = sub(back(after.map(|c| c.re)), before.map(|c| c.re)).map(f64::abs);
            // Fields of order 1, by solutions to 1e-11.
            assert!(off.into_iter().fold(0.0, f64::max) < 1e-8, "{elements:?} {place:?}: {off:?}");
        }
    }
}
