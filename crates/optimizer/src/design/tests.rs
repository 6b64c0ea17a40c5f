//! The map from variables to the surface, for every direction and control.

use std::sync::Arc;

use fluxmorph_geometry::generate::{BlockParameters, ShieldParameters, block, shield};
use fluxmorph_geometry::tet4::{area_vector, norm, sub};

use super::*;

fn plate() -> Mesh {
    let parameters = ShieldParameters { skin: vec![], side_skin: vec![5e-3], ..ShieldParameters::default() };
    shield(&parameters).expect("defaults are valid")
}

fn plate_surface(mesh: &Mesh, grid: Option<[usize; 2]>) -> DesignSurface {
    let triangles = mesh.topology().surface("plate_bottom").expect("the shield has it");
    let setup = DesignSetup {
        control: grid.map_or(Control::Nodes, Control::Grid),
        ..DesignSetup::new(triangles, Direction::Along([0.0, 0.0, -1.0]))
    };
    DesignSurface::new(mesh, &setup).expect("a plate carries a grid")
}

/// A block of edge length 1 with this many cells along each edge, its points moved by a function.
pub(super) fn moved_block(cells: usize, to: impl Fn(Point) -> Point) -> Mesh {
    let mesh = block(&BlockParameters { size: [1.0; 3], cells: [cells, cells, 2] }).expect("a block");
    let points = mesh.points().iter().map(|&x| to(x)).collect();
    Mesh::new(Arc::clone(mesh.topology()), points).expect("no element is inverted")
}

/// The upper face becomes a part of the sphere of radius 2 about (0, 0, −1).
pub(super) fn cap(x: Point) -> Point {
    [x[0], x[1], x[2] * ((4.0 - x[0] * x[0] - x[1] * x[1]).sqrt() - 1.0)]
}

/// Outer faces on a named surface, oriented outwards.
pub(super) fn outward(mesh: &Mesh, name: &str) -> Vec<[NodeId; 3]> {
    let sorted = |mut nodes: [NodeId; 3]| {
        nodes.sort_unstable();
        nodes
    };
    let named: BTreeSet<_> =
        mesh.topology().surface(name).expect("a block has it").iter().map(|t| sorted(*t)).collect();
    mesh.topology().facets().iter().map(|f| f.nodes).filter(|t| named.contains(&sorted(*t))).collect()
}

/// The upper face of a block, cut by the planes x = 0 and y = 0.
pub(super) fn quarter(mesh: &Mesh, direction: Direction, control: Control) -> DesignSetup {
    let planes: Vec<_> = ["x_min", "y_min"].iter().flat_map(|name| outward(mesh, name)).collect();
    DesignSetup {
        control,
        kept: planes.clone(),
        cuts: planes,
        ..DesignSetup::new(&outward(mesh, "z_max"), direction)
    }
}

pub(super) const UP: Direction = Direction::Along([0.0, 0.0, 1.0]);

pub(super) fn build(mesh: &Mesh, setup: &DesignSetup) -> DesignSurface {
    DesignSurface::new(mesh, setup).unwrap_or_else(|e| panic!("{e}"))
}

fn values(surface: &DesignSurface, of: impl Fn(Point) -> f64) -> Vec<f64> {
    surface.points().iter().map(|&x| of(x)).collect()
}

#[test]
fn the_papers_control_grid_has_91_points_in_the_contracts_order() {
    let surface = plate_surface(&plate(), Some([7, 13]));
    assert_eq!(surface.variable_count(), 91);
    for (k, point) in surface.points().iter().enumerate() {
        let expected = [0.02 * (k / 13) as f64, 0.02 * (k % 13) as f64, -0.01];
        assert!((0..3).all(|d| (point[d] - expected[d]).abs() < 1e-12), "{k}: {point:?}");
    }
    let [slow, fast] = surface.grid_sides().expect("a grid");
    assert_eq!([(slow.axis, slow.count), (fast.axis, fast.count)], [(0, 7), (1, 13)]);
    assert!([slow, fast].iter().all(|side| (side.spacing() - 0.02).abs() < 1e-15));
    assert!(plate_surface(&plate(), None).grid_sides().is_none());
}

#[test]
fn a_bilinear_height_is_reproduced_at_every_node() {
    let mesh = plate();
    let surface = plate_surface(&mesh, Some([7, 13]));
    let height = |x: Point| 1e-3 * (1.0 + 3.0 * x[0] - 2.0 * x[1] + 7.0 * x[0] * x[1]);
    let p = values(&surface, height);
    for (&node, h) in surface.nodes().iter().zip(surface.normal_displacements(&p)) {
        assert!((h - height(mesh.point(node))).abs() < 1e-15);
    }
}

#[test]
fn the_gradient_is_the_transpose_of_the_displacement() {
    let (plate, curved) = (plate(), moved_block(6, cap));
    let mirrored = |setup: DesignSetup| DesignSetup {
        mirrors: vec![Mirror { axis: 0, at: 0.5 }],
        boundary: BoundaryMotion::Fixed,
        ..setup
    };
    let flat = moved_block(6, |x| x);
    let edged = ["x_max", "z_max"].map(|name| outward(&flat, name)).concat();
    let edged = DesignSetup { triangles: edged, ..quarter(&flat, Direction::Normal, Control::Filter(0.4)) };
    let surfaces = [
        plate_surface(&plate, None),
        plate_surface(&plate, Some([7, 13])),
        plate_surface(&plate, Some([2, 2])),
        build(&curved, &quarter(&curved, Direction::Normal, Control::Nodes)),
        build(&curved, &quarter(&curved, Direction::Normal, Control::Grid([3, 4]))),
        build(&curved, &quarter(&curved, Direction::Normal, Control::Filter(0.4))),
        build(&flat, &edged),
        build(&flat, &mirrored(quarter(&flat, UP, Control::Filter(0.4)))),
        build(&flat, &mirrored(quarter(&flat, UP, Control::Grid([4, 3])))),
    ];
    for surface in surfaces {
        let p: Vec<f64> = (0..surface.variable_count()).map(|k| (k as f64 * 0.7).sin()).collect();
        let g: Vec<Point> =
            (0..surface.nodes().len()).map(|k| [0.3, (k as f64).cos(), (k as f64 * 1.3).sin()]).collect();
        let terms: Vec<f64> = surface.displacement(&p).iter().zip(&g).map(|(u, g)| dot(*u, *g)).collect();
        let left: f64 = terms.iter().sum();
        let right: f64 = surface.gradient(&g).iter().zip(&p).map(|(g, p)| g * p).sum();
        // Both are the same sum in another order.
        let size: f64 = terms.iter().map(|t| t.abs()).sum();
        assert!((left - right).abs() < 1e-14 * size, "{left} {right} of {size}");
    }
}

#[test]
fn a_uniform_variable_translates_a_flat_surface() {
    let mesh = moved_block(6, |x| x);
    for control in [Control::Nodes, Control::Grid([3, 5]), Control::Filter(0.3)] {
        for direction in [UP, Direction::Normal] {
            let surface = build(&mesh, &quarter(&mesh, direction, control));
            for u in surface.displacement(&vec![0.2; surface.variable_count()]) {
                assert!(norm(sub(u, [0.0, 0.0, 0.2])) < 1e-15, "{control:?} {direction:?}: {u:?}");
            }
        }
    }
}

#[test]
fn a_sphere_grows_along_its_normals_and_keeps_its_symmetry_planes() {
    let errors = [8, 16].map(|cells| {
        let mesh = moved_block(cells, cap);
        let surface = build(&mesh, &quarter(&mesh, Direction::Normal, Control::Nodes));
        let mut worst = 0.0_f64;
        let displacement = surface.displacement(&vec![0.1; surface.variable_count()]);
        for (&node, u) in surface.nodes().iter().zip(displacement) {
            let x = mesh.point(node);
            let radial = sub(x, [0.0, 0.0, -1.0]).map(|c| 0.1 * c / 2.0);
            assert!((norm(u) - 0.1).abs() < 1e-15);
            for d in (0..2).filter(|&d| x[d] == 0.0) {
                assert_eq!(u[d], 0.0, "{x:?} must stay on its plane");
            }
            let error = norm(sub(u, radial)) / 0.1;
            let on_edge = x[0] == 1.0 || x[1] == 1.0;
            // At a free edge triangles are on one side only: half a cell's turn of the normal, radius 2.
            assert!(error < 0.5 / cells as f64, "{x:?}: {error}");
            if !on_edge {
                worst = worst.max(error);
            }
        }
        worst
    });
    println!("normals off the sphere's: {errors:?}");
    assert!(errors[1] < 0.6 * errors[0], "normals converge: {errors:?}");
}

#[test]
fn a_node_in_a_corner_of_three_planes_stays() {
    let mesh = moved_block(3, |x| x);
    let mut setup = quarter(&mesh, Direction::Normal, Control::Nodes);
    // A third face that holds the origin's opposite: the corner of the upper face lies on all of them.
    setup.kept.push(setup.triangles[0]);
    let all = build(&mesh, &setup);
    assert_eq!(all.variable_count(), 16, "a face of the surface itself keeps nothing");
    setup.kept = ["x_min", "y_min", "z_max"].iter().flat_map(|name| outward(&mesh, name)).collect();
    setup.triangles.retain(|t| t.iter().any(|&n| mesh.point(n)[0] > 0.5));
    let held = build(&mesh, &setup);
    let beside = held.nodes().iter().zip(held.directions()).filter(|(n, _)| mesh.point(**n)[0] < 0.5);
    for (_, direction) in beside {
        assert_eq!(*direction, [0.0; 3], "its plane is kept by the triangles outside of the surface");
    }
    assert!(held.variable_count() < held.nodes().len());
}

#[test]
fn a_cell_is_the_square_of_two_triangles_and_thin_strips_hardly_count() {
    let even = moved_block(10, |x| x);
    let own = outward(&even, "z_max");
    assert!((cell_size(&even, &own) - 0.1).abs() < 1e-14);
    assert!((default_filter_radius(&even, &own) - 0.15).abs() < 1e-14);
    // The last cell along x is a tenth as wide, and the others are 1.1 times as wide.
    let strip = |x: Point| [if x[0] < 0.95 { 1.1 * x[0] } else { x[0] }, x[1], x[2]];
    let graded = moved_block(10, strip);
    let wide = cell_size(&graded, &outward(&graded, "z_max"));
    assert!((wide / (0.1 * 1.1_f64.sqrt()) - 1.0).abs() < 0.01, "{wide}");
}

#[test]
fn the_filter_keeps_the_bounds_and_sums_to_one() {
    let mesh = moved_block(9, cap);
    for radius in [0.05, 0.2, 5.0] {
        let surface = build(&mesh, &quarter(&mesh, Direction::Normal, Control::Filter(radius)));
        for row in surface.rows() {
            let sum: f64 = row.iter().map(|(_, weight)| weight).sum();
            assert!((sum - 1.0).abs() < 1e-14 && row.iter().all(|&(_, weight)| weight >= 0.0), "{sum}");
            assert!(row.is_sorted_by(|a, b| a.0 < b.0));
            // Below the size of a cell a node sees nothing but itself.
            assert!(radius > 0.1 || row.len() == 1);
        }
    }
}

/// Greatest difference between the filtered surfaces of one field on meshes of `cells` and twice as many cells.
fn mesh_dependence(cells: usize, radius: f64, field: impl Fn(Point) -> f64) -> f64 {
    let (coarse, fine) = (moved_block(cells, |x| x), moved_block(2 * cells, |x| x));
    let [(nodes, normal_displacements), (fine_nodes, fine_heights)] = [&coarse, &fine].map(|mesh| {
        let surface = build(mesh, &quarter(mesh, UP, Control::Filter(radius)));
        (surface.nodes().to_vec(), surface.normal_displacements(&values(&surface, &field)))
    });
    let difference = |(node, h): (&NodeId, &f64)| {
        let at = |n: &NodeId| norm(sub(fine.point(*n), coarse.point(*node))) < 1e-9;
        let same = fine_nodes.iter().position(at).expect("every other node of the fine mesh");
        (h - fine_heights[same]).abs()
    };
    nodes.iter().zip(&normal_displacements).map(difference).fold(0.0, f64::max)
}

#[test]
fn two_meshes_give_the_same_filtered_surface() {
    let radius = 0.25;
    let smooth = |x: Point| (7.0 * x[0]).sin() * (5.0 * x[1]).cos();
    let errors = [16, 32].map(|cells| mesh_dependence(cells, radius, smooth));
    // A quadrature with linear elements: second order in the size of the cells.
    println!("a smooth field: {errors:.5?}");
    assert!(errors[0] < 0.02 && errors[1] < 0.35 * errors[0], "{errors:?}");
    // The worst field there is: a jump between two nodes lies half a cell beyond the first, so a quarter of a coarse cell
    // apart on the two meshes. The surface's slope there is that of the filtered jump, 3 / (π r); what the quadrature adds
    // is of second order.
    let jump = |x: Point| if x[0] > 0.5 { 1.0 } else { 0.0 };
    for cells in [16, 32] {
        let (error, apart) = (mesh_dependence(cells, radius, jump), 0.25 / cells as f64);
        let expected = apart * 3.0 / (std::f64::consts::PI * radius);
        println!("a jump, {cells} cells: {error:.5}, expected {expected:.5}");
        assert!(error < expected * (1.0 + 2.0 / cells as f64 / radius), "{error} {expected}");
    }
}

#[test]
fn a_quarter_filters_like_the_whole() {
    let radius = 0.3;
    let part = moved_block(10, |x| x);
    let whole = {
        let mesh = block(&BlockParameters { size: [2.0, 2.0, 1.0], cells: [20, 20, 2] }).expect("a block");
        let points = mesh.points().iter().map(|x| [x[0] - 1.0, x[1] - 1.0, x[2]]).collect();
        Mesh::new(Arc::clone(mesh.topology()), points).expect("a translation")
    };
    let field = |x: Point| (3.0 * x[0].abs() + 1.0).sin() + (4.0 * x[1].abs()).cos();
    let surface = build(&part, &quarter(&part, UP, Control::Filter(radius)));
    let full =
        DesignSetup { control: Control::Filter(radius), ..DesignSetup::new(&outward(&whole, "z_max"), UP) };
    let full = build(&whole, &full);
    let normal_displacements = full.normal_displacements(&values(&full, field));
    for (&node, h) in surface.nodes().iter().zip(surface.normal_displacements(&values(&surface, field))) {
        let x = part.point(node);
        // A corner's triangles are not laid symmetrically, so its area is no quarter of a node's inside.
        let corner = |c: f64| c < radius || c > 1.0 - radius;
        if corner(x[0]) && corner(x[1]) {
            continue;
        }
        let same =
            full.nodes().iter().position(|&n| norm(sub(whole.point(n), x)) < 1e-9).expect("the same nodes");
        assert!((h - normal_displacements[same]).abs() < 1e-12, "{x:?}: {h} {}", normal_displacements[same]);
    }
}

#[test]
fn the_two_faces_of_a_sheet_do_not_mix() {
    let mesh = moved_block(6, |x| [x[0], x[1], 0.01 * x[2]]);
    let triangles = [outward(&mesh, "z_min"), outward(&mesh, "z_max")].concat();
    let setup =
        DesignSetup { control: Control::Filter(0.5), ..DesignSetup::new(&triangles, Direction::Normal) };
    let surface = build(&mesh, &setup);
    let p = values(&surface, |x| if x[2] > 0.005 { 1.0 } else { 0.0 });
    for (&node, h) in surface.nodes().iter().zip(surface.normal_displacements(&p)) {
        let expected = if mesh.point(node)[2] > 0.005 { 1.0 } else { 0.0 };
        assert!((h - expected).abs() < 1e-14);
    }
}

#[test]
fn mirrored_nodes_share_a_variable_and_move_alike() {
    let dome = |x: Point| {
        let (u, v) = (x[0] - 0.5, x[1] - 0.5);
        [x[0], x[1], x[2] * (1.0 - u * u - 0.5 * v * v)]
    };
    let mesh = moved_block(8, dome);
    let (x, y) = (Mirror { axis: 0, at: 0.5 }, Mirror { axis: 1, at: 0.5 });
    for (mirrors, nodes, grid) in [(vec![x], 45, 9), (vec![x, y], 25, 6)] {
        for (control, count) in
            [(Control::Nodes, nodes), (Control::Filter(0.3), nodes), (Control::Grid([5, 3]), grid)]
        {
            let setup = DesignSetup {
                control,
                mirrors: mirrors.clone(),
                ..DesignSetup::new(&outward(&mesh, "z_max"), Direction::Normal)
            };
            let surface = build(&mesh, &setup);
            assert_eq!(surface.variable_count(), count, "{control:?}");
            let p: Vec<f64> = (0..count).map(|k| (1.3 * k as f64).sin()).collect();
            let displacement = surface.displacement(&p);
            for (i, &node) in surface.nodes().iter().enumerate() {
                for mirror in &mirrors {
                    let image = mirror.image(mesh.point(node));
                    let at = |n: &NodeId| norm(sub(mesh.point(*n), image)) < 1e-12;
                    let partner = surface.nodes().iter().position(at).expect("a symmetric mesh");
                    let off = sub(displacement[i], mirror.reflect(displacement[partner]));
                    // Sums in another order, of weights and variables of order 1.
                    assert!(norm(off) < 1e-14, "{control:?} at {:?}: {off:?}", mesh.point(node));
                }
            }
        }
    }
}

#[test]
fn a_node_without_partner_is_named() {
    let mesh = moved_block(4, |x| x);
    let tied = |at: f64, direction: Direction, axis: usize| {
        let setup = DesignSetup {
            mirrors: vec![Mirror { axis, at }],
            ..DesignSetup::new(&outward(&mesh, "z_max"), direction)
        };
        DesignSurface::new(&mesh, &setup).expect_err("no symmetry")
    };
    let error = tied(0.45, UP, 0);
    assert!(
        matches!(error, DesignError::NoPartner { axis: 'x', point, .. } if point == [0.0, 0.0, 1.0]),
        "{error}"
    );
    assert!(error.to_string().contains("no partner in the mirror x = 450.000 mm"), "{error}");
    assert!(matches!(tied(1.0, UP, 2), DesignError::Oblique { axis: 'z', .. }));
}

#[test]
fn a_fixed_boundary_stays_except_on_symmetry_planes() {
    let mesh = moved_block(8, |x| x);
    for (control, count) in [(Control::Nodes, 64), (Control::Filter(0.2), 81), (Control::Grid([3, 3]), 9)] {
        let surface =
            build(&mesh, &DesignSetup { boundary: BoundaryMotion::Fixed, ..quarter(&mesh, UP, control) });
        assert_eq!(surface.variable_count(), count, "{control:?}");
        let normal_displacements = surface.normal_displacements(&vec![1.0; count]);
        for (&node, h) in surface.nodes().iter().zip(normal_displacements) {
            let x = mesh.point(node);
            let expected = if x[0] == 1.0 || x[1] == 1.0 { 0.0 } else { 1.0 };
            assert!((h - expected).abs() < 1e-14, "{x:?}: {h}");
        }
    }
}

#[test]
fn a_filter_sees_the_images_in_planes_askew_as_in_those_of_the_axes() {
    let turned = |x: Point| {
        let (sin, cos) = 0.5_f64.sin_cos();
        [cos * x[0] - sin * x[1], sin * x[0] + cos * x[1], x[2]]
    };
    let [upright, askew] = [moved_block(6, |x| x), moved_block(6, turned)]
        .map(|mesh| build(&mesh, &quarter(&mesh, UP, Control::Filter(0.4))));
    assert_same_rows(&upright, &askew);
}

fn assert_same_rows(a: &DesignSurface, b: &DesignSurface) {
    for (own, other) in a.rows().iter().zip(b.rows()) {
        assert_eq!(own.len(), other.len());
        let off = own.iter().zip(other).map(|(a, b)| (a.1 - b.1).abs()).fold(0.0, f64::max);
        assert!(off < 1e-12 && own.iter().zip(other).all(|(a, b)| a.0 == b.0), "{own:?} {other:?}");
    }
}

/// The product of directions at right angles is rounding once the block is turned.
#[test]
fn faces_at_right_angles_do_not_mix_however_a_block_is_turned() {
    let turned = |angle: f64| {
        let mesh = moved_block(5, |x| {
            let (sin, cos) = angle.sin_cos();
            let [x, y, z] = [cos * x[0] - sin * x[1], sin * x[0] + cos * x[1], x[2]];
            [x, cos * y - sin * z, sin * y + cos * z]
        });
        let faces: Vec<_> = ["x_max", "y_max", "z_max"].iter().flat_map(|f| outward(&mesh, f)).collect();
        let setup = DesignSetup::new(&faces, Direction::Normal);
        build(&mesh, &DesignSetup { control: Control::Filter(0.7), ..setup })
    };
    let upright = turned(0.0);
    for angle in [1e-7, 0.5, std::f64::consts::FRAC_PI_2, 2.1] {
        assert_same_rows(&upright, &turned(angle));
    }
}

/// Half of a quarter, below the diagonal, over which the triangles of a block are mirror images: images of images are the other
/// quarters.
#[test]
fn a_filter_on_an_eighth_gives_the_surface_of_the_quarter() {
    let mesh = moved_block(6, |x| x);
    let whole = quarter(&mesh, UP, Control::Filter(0.4));
    let is_below = |t: &[NodeId; 3]| t.iter().all(|&n| mesh.point(n)[0] >= mesh.point(n)[1] - 1e-9);
    let triangles: Vec<_> = whole.triangles.iter().copied().filter(is_below).collect();
    assert_eq!(2 * triangles.len(), whole.triangles.len());
    let on_diagonal = |k: usize, z: f64| {
        let at = |x: Point| (x[0] - k as f64 / 6.0).abs() + (x[1] - k as f64 / 6.0).abs() + (x[2] - z).abs();
        mesh.topology().nodes().find(|&n| at(mesh.point(n)) < 1e-9).expect("a node of the block")
    };
    let diagonal = (0..6).map(|k| [on_diagonal(k, 1.0), on_diagonal(k + 1, 1.0), on_diagonal(k, 0.5)]);
    let cuts: Vec<_> = outward(&mesh, "y_min").into_iter().chain(diagonal).collect();
    let eighth = build(&mesh, &DesignSetup { triangles, cuts, ..whole.clone() });
    let whole = build(&mesh, &whole);
    let symmetric = |x: Point| (3.0 * x[0]).sin() * (3.0 * x[1]).sin() + x[0] * x[1] + x[0] + x[1];
    let [heights, expected] =
        [&eighth, &whole].map(|surface| surface.normal_displacements(&values(surface, symmetric)));
    let place = |n: &NodeId| whole.nodes().iter().position(|other| other == n).expect("a node of both");
    for (node, height) in eighth.nodes().iter().zip(heights) {
        let whole = expected[place(node)];
        assert!((height - whole).abs() < 1e-12, "{:?}: {height} {whole}", mesh.point(*node));
    }
}

/// Facets of a wall that is round are no planes of a device; beside them the planes of a wedge are, with the digits of a file.
#[test]
fn the_facets_of_a_curved_wall_have_no_images() {
    let angle = (180.0_f64 / 7.0).to_radians();
    let rounded = |x: f64| (1e7 * x).round() / 1e7;
    // A seventh of half a disc from the axis on, its round end at x_max.
    let wedge = |x: Point| {
        let (sin, cos) = (angle * x[1]).sin_cos();
        [x[0] * cos, x[0] * sin, x[2]].map(rounded)
    };
    let whole = block(&BlockParameters { size: [1.0; 3], cells: [6, 6, 2] }).expect("a block");
    let off_axis = |x: Point| wedge([0.02 + x[0], x[1], x[2]]);
    let mesh = Mesh::new(Arc::clone(whole.topology()), whole.points().iter().map(|&x| off_axis(x)).collect())
        .expect("no element is inverted");
    let of = |walls: &[&str]| {
        let cuts: Vec<_> = walls.iter().flat_map(|name| outward(&mesh, name)).collect();
        let setup = DesignSetup { cuts, ..quarter(&mesh, UP, Control::Filter(0.4)) };
        build(&mesh, &setup)
    };
    let [alone, beside] = [of(&["y_min", "y_max"]), of(&["y_min", "y_max", "x_max"])];
    assert_eq!(alone.rows(), beside.rows());
    assert_eq!(of(&["y_min", "x_max"]).rows(), of(&["y_min"]).rows());
    // All images of the whole device.
    let images = |x: Point| {
        (0..7).flat_map(move |k| [1.0, -1.0].map(|side| (f64::from(k) * 2.0 * angle, side))).map(
            move |(turn, side)| {
                let ((sin, cos), y) = (turn.sin_cos(), side * x[1]);
                [x[0] * cos - y * sin, x[0] * sin + y * cos, x[2]]
            },
        )
    };
    let nodes = alone.nodes();
    let mut areas = vec![0.0; nodes.len()];
    for triangle in outward(&mesh, "z_max") {
        let third = norm(area_vector(triangle.map(|n| mesh.point(n)))) / 3.0;
        triangle.iter().for_each(|n| areas[nodes.binary_search(n).expect("it moves")] += third);
    }
    for (row, &node) in alone.rows().iter().zip(nodes) {
        let seen = |j: usize| {
            let weight = |x: Point| (1.0 - norm(sub(x, mesh.point(node))) / 0.4).max(0.0);
            areas[j] * images(mesh.point(nodes[j])).map(weight).sum::<f64>()
        };
        let sum: f64 = (0..nodes.len()).map(seen).sum();
        for &(j, weight) in row {
            assert!((weight - seen(j) / sum).abs() < 1e-5, "{node:?} {j}: {weight} {}", seen(j) / sum);
        }
    }
}

/// The cells of a block are all cut along one diagonal: the heights of a grid that are the same across the mirror leave no trace of it.
#[test]
fn a_surface_that_is_symmetric_in_its_nodes_alone_is_known() {
    let mesh = moved_block(6, |x| x);
    let mirrors = vec![Mirror { axis: 0, at: 0.5 }];
    let count = |control: Control| {
        let setup = DesignSetup { mirrors: mirrors.clone(), cuts: Vec::new(), ..quarter(&mesh, UP, control) };
        edges_without_image(&mesh, (&build(&mesh, &setup), &setup.triangles), &mirrors)
    };
    assert!(count(Control::Nodes) > 0 && count(Control::Grid([4, 3])) > 0);
    assert_eq!(count(Control::Grid([2, 3])), 0);
}
