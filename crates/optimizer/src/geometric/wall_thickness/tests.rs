use super::*;
use crate::design::{DesignSetup, Direction};
use fluxmorph_geometry::generate::{BoxRegion, BoxesParameters, ShieldParameters, boxes, shield};
use fluxmorph_geometry::tet4::add;

#[test]
fn the_plate_is_ten_millimetres_thick_at_every_node() {
    let parameters = ShieldParameters { refinement: 0.5, ..ShieldParameters::default() };
    let mesh = shield(&parameters).expect("defaults are valid");
    let triangles = mesh.topology().surface("plate_bottom").expect("the shield has it");
    let surface = DesignSurface::new(&mesh, &DesignSetup::new(triangles, Direction::Along([0.0, 0.0, -1.0])))
        .expect("every node is a variable");
    let plate = mesh.topology().region("plate").expect("the shield has it");
    let thickness = WallThickness::measure(&mesh, &[plate], &surface).expect("a plate has two faces");
    assert!(thickness.initial().all(|(_, t)| (t - 0.010).abs() < 1e-12));
    let held = |n: NodeId| {
        let [x, y, z] = mesh.point(n);
        let moves = surface.nodes().binary_search(&n).is_ok();
        [x, y, if moves { z - 0.001 } else { z }]
    };
    let thick: Vec<f64> = thickness.walls(held).map(|(_, wall)| wall.thickness).collect();
    assert!(thick.len() == surface.nodes().len() && thick.iter().all(|t| (t - 0.011).abs() < 1e-12));
}

/// Against a direction into the body there is none: what says so names a node inside of the surface.
#[test]
fn a_node_with_nothing_opposite_is_named() {
    let (corners, face) = ([[0.0, 0.0, 0.0], [1.0, 1.0, 0.5]], 0.5);
    let mesh = parts([[-1.0, -1.0, -1.0], [2.0, 2.0, 2.0]], 0.5, &[("body", corners)]);
    let body = mesh.topology().region("body").expect("it has one");
    let top = |n: &NodeId| {
        let [x, y, z] = mesh.point(*n);
        (0.0..=1.0).contains(&x) && (0.0..=1.0).contains(&y) && z == face
    };
    let all = mesh.topology().facets().iter().map(|facet| facet.nodes);
    let faces: Vec<[NodeId; 3]> = all.filter(|face| face.iter().all(top)).collect();
    for (direction, expected) in [(1.0, None), (-1.0, Some([0.5, 0.5, 0.5]))] {
        let setup = DesignSetup::new(&faces, Direction::Along([0.0, 0.0, direction]));
        let surface = DesignSurface::new(&mesh, &setup).expect("every node is a variable");
        let measured = WallThickness::measure(&mesh, &[body], &surface);
        assert_eq!(measured.err().map(|why| why.at), expected.map(Some), "{direction}");
    }
    let why = NoThickness { at: Some([0.5, 0.5, 0.5]) }.to_string();
    assert!(
        why.contains(
            "from the design node at (500.000, 500.000, 500.000) mm against its direction meets no opposite face"
        ),
        "{why}"
    );
}

/// Boxes with names in one of air.
fn parts(air: [Point; 2], size: f64, parts: &[(&str, [Point; 2])]) -> Mesh {
    let part = |&(name, corners): &(&str, [Point; 2])| BoxRegion {
        name: name.to_owned(),
        corners,
        size: [size; 3],
        skin: [f64::INFINITY; 3],
        cells: None,
    };
    boxes(&BoxesParameters {
        corners: air,
        regions: parts.iter().map(part).collect(),
        sizes: vec![],
        surfaces: vec![],
        growth: 2.0,
        refinement: 1.0,
        division: None,
    })
    .expect("sound boxes")
}

/// Layers between these heights with air below and above.
fn layers(heights: &[(&str, [f64; 2])]) -> Mesh {
    let corners = |[from, to]: [f64; 2]| [[0.0, 0.0, from], [1.0, 1.0, to]];
    let layers: Vec<_> = heights.iter().map(|&(name, ends)| (name, corners(ends))).collect();
    parts(corners([-0.5, 1.7]), 0.5, &layers)
}

/// The faces at some heights as the design.
fn faces_at(mesh: &Mesh, heights: &[f64], direction: Direction) -> DesignSurface {
    let is_designed = |face: &[NodeId; 3]| {
        let at = |z: &f64| face.iter().all(|n| (mesh.point(*n)[2] - z).abs() < 1e-12);
        heights.iter().any(at)
    };
    // The first looks down.
    let turned = |[a, b, c]: [NodeId; 3]| {
        let looks_down = area_vector([a, b, c].map(|n| mesh.point(n)))[2] < 0.0;
        let is_first = (mesh.point(a)[2] - heights[0]).abs() < 1e-12;
        if looks_down == is_first { [a, b, c] } else { [a, c, b] }
    };
    let all = mesh.topology().facets().iter().map(|facet| facet.nodes);
    let faces: Vec<[NodeId; 3]> = all.filter(is_designed).map(turned).collect();
    DesignSurface::new(mesh, &DesignSetup::new(&faces, direction)).expect("every node is a variable")
}

/// Plates one behind the other and touching ones, whichever region comes first: what lies behind a face is its own body.
#[test]
fn every_body_has_its_own_thickness() {
    let (apart, touching) = ([[0.0, 0.1], [1.0, 1.2]], [[0.0, 0.1], [0.1, 0.3]]);
    for (ends, direction) in [(apart, -1.0), (apart, 1.0), (touching, -1.0), (touching, 1.0)] {
        for names in [["thin", "thick"], ["thick", "thin"]] {
            let mut heights = [("thin", ends[0]), ("thick", ends[1])];
            heights.sort_by_key(|(name, _)| *name != names[0]);
            let mesh = layers(&heights);
            let designed = usize::from(direction > 0.0);
            let places = heights.map(|(_, ends)| ends[designed]);
            let surface = faces_at(&mesh, &places, Direction::Along([0.0, 0.0, direction]));
            let regions = names.map(|name| mesh.topology().region(name).expect("it has both"));
            let thickness = WallThickness::measure(&mesh, &regions, &surface).expect("both have two faces");
            for (i, t) in thickness.initial() {
                let is_thin = (mesh.point(surface.nodes()[i])[2] - ends[0][designed]).abs() < 1e-9;
                let expected = if is_thin { 0.1 } else { 0.2 };
                assert!((t - expected).abs() < 1e-12, "{ends:?} {direction} {names:?}: {t} {expected}");
            }
            assert_eq!(thickness.initial().count(), surface.nodes().len());
            let least = thickness.least_of_bodies(|n| mesh.point(n));
            let of = |name: &str| least[&mesh.topology().region(name).expect("it has both")];
            assert!((of("thin") - 0.1).abs() < 1e-12 && (of("thick") - 0.2).abs() < 1e-12);
            assert!(WallThickness::measure(&mesh, &[], &surface).is_err_and(|why| why.at.is_none()));
        }
    }
}

/// Where a plane of symmetry cuts a body that its surface replaces, the mesh that is solved on has no nodes within the cut.
#[test]
fn what_lies_opposite_and_is_not_solved_on_stays_where_it_is() {
    let mesh = layers(&[("plate", [0.0, 0.1])]);
    let surface = faces_at(&mesh, &[0.0], Direction::Along([0.0, 0.0, -1.0]));
    let plate = mesh.topology().region("plate").expect("it has one");
    let measured = WallThickness::measure(&mesh, &[plate], &surface).expect("it has two faces");
    let is_opposite = |n: NodeId| (mesh.point(n)[2] - 0.1).abs() < 1e-12;
    let new_of: Vec<_> = mesh.topology().nodes().map(|n| (!is_opposite(n)).then_some(n)).collect();
    let thickness = measured.renumbered(&mesh, &new_of);
    let lower = |n: NodeId| {
        assert!(!is_opposite(n), "it is not asked for");
        add(mesh.point(n), [0.0, 0.0, -0.02])
    };
    for (_, wall) in thickness.walls(lower) {
        assert!((wall.thickness - 0.12).abs() < 1e-12, "{}", wall.thickness);
        assert_eq!(wall.derivatives.iter().flatten().count(), 1);
    }
    assert_eq!(thickness.walls(lower).count(), surface.nodes().len());
    assert_eq!(thickness.opposite_nodes().count(), 0);
    assert!(thickness.opposite_faces().flat_map(|(_, face)| face).all(is_opposite));
}

/// Plates side by side under one face: a node of both has the thickness of each.
#[test]
fn a_node_of_two_bodies_has_two_thicknesses() {
    let air = [[-1.0, -0.5, -0.5], [2.0, 1.5, 1.5]];
    let (thick, thin) = ([[0.0, 0.0, 0.2], [0.5, 1.0, 1.0]], [[0.5, 0.0, 0.6], [1.0, 1.0, 1.0]]);
    for names in [["thick", "thin"], ["thin", "thick"]] {
        let mut own = [("thick", thick), ("thin", thin)];
        own.sort_by_key(|(name, _)| *name != names[0]);
        let mesh = parts(air, 0.5, &own);
        let surface = faces_at(&mesh, &[1.0], Direction::Along([0.0, 0.0, 1.0]));
        let bodies = names.map(|name| mesh.topology().region(name).expect("it is meshed"));
        let thickness = WallThickness::measure(&mesh, &bodies, &surface).expect("two plates");
        let is_shared = |&n: &&NodeId| (mesh.point(*n)[0] - 0.5).abs() < 1e-12;
        let shared = surface.nodes().iter().filter(is_shared).count();
        assert!(shared > 0 && thickness.initial().count() == surface.nodes().len() + shared);
        let at_place = |n: NodeId| mesh.point(n);
        for (i, least) in thickness.least_at_nodes(at_place) {
            let expected = if mesh.point(surface.nodes()[i])[0] < 0.499 { 0.8 } else { 0.4 };
            assert!((least - expected).abs() < 1e-12, "{least} for {expected}");
        }
        let least = thickness.least_of_bodies(at_place);
        let of = |name: &str| least[&mesh.topology().region(name).expect("it is meshed")];
        assert!((of("thick") - 0.8).abs() < 1e-12 && (of("thin") - 0.4).abs() < 1e-12, "{least:?}");
    }
}

/// A leg with both faces designed beside another one that is held: its own other face is nearer than the other leg.
#[test]
fn a_wall_ends_where_its_body_does_first() {
    let mesh = layers(&[("legs", [0.0, 0.1]), ("legs", [1.0, 1.2])]);
    let surface = faces_at(&mesh, &[0.0, 0.1], Direction::Normal);
    let legs = mesh.topology().region("legs").expect("it has them");
    let thickness = WallThickness::measure(&mesh, &[legs], &surface).expect("it has two faces");
    assert_eq!(thickness.initial().count(), surface.nodes().len());
    assert!(thickness.initial().all(|(_, t)| (t - 0.1).abs() < 1e-12));
}

/// Half a degree off the normal, as the mean of a few facets of a round face may be: at one side rays lead past the plate.
#[test]
fn a_ray_that_misses_the_body_at_a_rim_costs_no_other_node_its_thickness() {
    let mesh = layers(&[("plate", [0.0, 0.1])]);
    let angle = 0.5_f64.to_radians();
    let surface = faces_at(&mesh, &[0.1], Direction::Along([angle.sin(), 0.0, angle.cos()]));
    let plate = mesh.topology().region("plate").expect("it is there");
    let thickness = WallThickness::measure(&mesh, &[plate], &surface).expect("most rays meet it");
    let inner = surface.nodes().iter().filter(|n| mesh.point(**n)[0] > 0.0).count();
    assert!(inner < surface.nodes().len());
    assert_eq!(thickness.initial().count(), inner);
    assert!(thickness.initial().all(|(_, t)| (t - 0.1 / angle.cos()).abs() < 1e-12));
}

/// A side that bulges by less than a tenth, as facets of a round one may: the ray from the rim leaves through it half-way down.
#[test]
fn a_rim_of_a_round_body_has_no_thickness_to_its_side() {
    let flat = parts([[-1.0; 3], [2.0; 3]], 0.25, &[("body", [[0.0; 3], [1.0, 1.0, 1.0]])]);
    let bulge = |&[x, _, z]: &Point| {
        let outwards = if x == 0.0 && (0.0..=1.0).contains(&z) { 0.06 * (1.0 - z) * (z - 0.3) } else { 0.0 };
        [-outwards, 0.0, 0.0]
    };
    let mesh =
        flat.moved(&flat.points().iter().map(bulge).collect::<Vec<_>>()).expect("far less than a cell");
    let surface = faces_at(&mesh, &[1.0], Direction::Along([0.0, 0.0, 1.0]));
    let body = mesh.topology().region("body").expect("it is there");
    let thickness = WallThickness::measure(&mesh, &[body], &surface).expect("most rays meet its lower face");
    let inner = surface.nodes().iter().filter(|n| mesh.point(**n)[0] > 0.0).count();
    assert_eq!(thickness.initial().count(), inner);
    assert!(thickness.initial().all(|(_, t)| (t - 1.0).abs() < 1e-12));
}

/// A high plate on a wide one, both tops designed: rays at the edge of the step run along its side, past the wide plate's top.
#[test]
fn a_wall_does_not_end_at_the_foot_of_a_step() {
    let [wide, high] = [[[0.0, 0.0, 0.0], [1.0, 1.0, 0.2]], [[0.25, 0.25, 0.2], [0.75, 0.75, 0.3]]];
    let air = [[-0.5, -0.5, -0.5], [1.5, 1.5, 1.0]];
    let mesh = parts(air, 0.25, &[("plate", wide), ("plate", high)]);
    for designed in [&[0.2, 0.3][..], &[0.3]] {
        let surface = faces_at(&mesh, designed, Direction::Along([0.0, 0.0, 1.0]));
        let plate = mesh.topology().region("plate").expect("it is there");
        let thickness = WallThickness::measure(&mesh, &[plate], &surface).expect("it has a lower face");
        for (i, t) in thickness.initial() {
            let height = mesh.point(surface.nodes()[i])[2];
            assert!((t - height).abs() < 1e-12, "{designed:?}: {t} at {height}");
        }
    }
}

/// A dent in the lower face of which rays from the design pass the deepest place by: it is measured from there, and moves with the
/// design as the triangle above does. Where the lower face is flat nothing is said twice.
#[test]
fn a_dent_between_the_rays_is_measured_from_its_own_node() {
    let flat = parts([[-1.0; 3], [2.0; 3]], 0.25, &[("body", [[0.0; 3], [1.0; 3]])]);
    let depth = 0.1;
    let is_dent = |p: &Point| *p == [0.5, 0.5, 0.0];
    let dented = |p: &Point| if is_dent(p) { [0.0, 0.0, depth] } else { [0.0; 3] };
    let mesh = flat.moved(&flat.points().iter().map(dented).collect::<Vec<_>>()).expect("less than a cell");
    // From one row of nodes to half-way between two others.
    let slope: f64 = 0.125;
    let direction = [slope, 0.0, 1.0].map(|c| c / slope.hypot(1.0));
    let surface = faces_at(&mesh, &[1.0], Direction::Along(direction));
    let body = mesh.topology().region("body").expect("it is there");
    let measured = |mesh: &Mesh| WallThickness::measure(mesh, &[body], &surface).expect("most rays meet it");
    let (thickness, without) = (measured(&mesh), measured(&flat));
    assert!(without.walls(|n| flat.point(n)).all(|(_, wall)| wall.bulge.is_none()));
    // Beside it the body is thicker than rays to its slopes say.
    let is_thinner = |(_, wall): &(usize, Wall)| wall.bulge.is_some_and(|bulge| bulge > 0.0);
    let facing: Vec<_> = thickness.walls(|n| mesh.point(n)).filter(is_thinner).collect();
    let [(place, wall)] = facing[..] else { panic!("{} nodes opposite say more", facing.len()) };
    let along = slope.hypot(1.0);
    assert!((wall.thickness - (1.0 - depth) * along).abs() < 1e-12, "{}", wall.thickness);
    // The rays from half-way to either side meet the slopes, of depth over one cell, at these heights.
    let heights = [depth / (2.0 - depth), depth / (2.0 + depth)];
    let said = 0.55 * (1.0 - heights[0]) + 0.45 * (1.0 - heights[1]);
    let bulge = (said - (1.0 - depth)) * along;
    assert!((wall.bulge.expect("it was filtered") - bulge).abs() < 1e-12, "{:?} {bulge}", wall.bulge);
    assert!(is_dent(&flat.point(wall.derivatives[0].expect("a node").0)));
    assert!(mesh.point(surface.nodes()[place])[0] >= 0.5);
    assert!((thickness.range(&mesh).0 - wall.thickness).abs() < 1e-15);
    // Heights that are linear in the place: what is above the dent is what they are there.
    let height = |[x, y, _]: Point| 0.3 * x - 0.2 * y;
    let place = |n: NodeId| {
        let at = mesh.point(n);
        let is_designed = surface.nodes().binary_search(&n).is_ok();
        let moved = if is_designed { height(at) } else { 0.0 };
        std::array::from_fn(|d| at[d] + moved * direction[d])
    };
    let (_, moved) = thickness.walls(place).find(is_thinner).expect("the same walls everywhere");
    let above = [0.5 + (1.0 - depth) * slope, 0.5, 1.0];
    assert!((moved.thickness - wall.thickness - height(above)).abs() < 1e-12);
}

/// A slab all of whose faces move along their normals, in a corner of the mesh: the lip at its rim is as thick as it is across, where a ray
/// against the mitred direction would say √2 times as much, and nothing of its other side.
#[test]
fn a_lip_at_an_edge_of_designed_faces_is_measured_across() {
    let mesh = parts([[0.0; 3], [2.0, 2.0, 1.0]], 0.25, &[("slab", [[0.0, 0.0, 0.25], [1.0, 1.0, 0.5]])]);
    let slab = mesh.topology().region("slab").expect("it has one");
    let all = mesh.topology().boundary(slab).into_iter();
    let is_inside = |face: &[NodeId; 3]| (0..2).all(|d| face.iter().any(|n| mesh.point(*n)[d] > 0.0));
    let faces: Vec<[NodeId; 3]> = all.filter(is_inside).collect();
    let surface = DesignSurface::new(&mesh, &DesignSetup::new(&faces, Direction::Normal))
        .expect("every node is a variable");
    let thickness = WallThickness::measure(&mesh, &[slab], &surface).expect("it has faces opposite");
    let is_at_rim = |x: Point| x[0] == 1.0 || x[1] == 1.0;
    // Across at every node of both faces; the side behind those of its rim and its own.
    let across = thickness.initial().filter(|(_, t)| (t - 0.25).abs() < 1e-12).count();
    assert_eq!(across, 2 * 5 * 5);
    assert!(thickness.initial().all(|(_, t)| (t - 0.25).abs() < 1e-12 || (t - 1.0).abs() < 1e-12));
    // The rim goes in by .05 on all three sides.
    let lip = |n: NodeId| {
        let x = mesh.point(n);
        let Ok(place) = surface.nodes().binary_search(&n) else { return x };
        let depth = if is_at_rim(x) { 0.05 * surface.mitres()[place] } else { 0.0 };
        std::array::from_fn(|d| x[d] - depth * surface.directions()[place][d])
    };
    let least = thickness.least_at_nodes(lip);
    for (place, thickness) in least {
        let at = mesh.point(surface.nodes()[place]);
        let expected = if is_at_rim(at) { 0.15 } else { 0.25 };
        // Rays begin a thousandth of a facet beside the rim, where the face opposite is as much nearer to what it was.
        assert!((thickness - expected).abs() < 2e-4, "{at:?}: {thickness} {expected}");
    }
}

/// Both faces are designed, so that nothing is measured from opposite.
#[test]
fn a_groove_in_a_designed_face_is_as_deep_as_it_is() {
    // Two cells thick: of a side between designed faces that one cell reaches across all nodes are designed.
    let mesh = layers(&[("slab", [0.2, 1.2])]);
    let is_bottom_of_groove = |x: Point| x[0] == 0.5 && x[2] == 1.2;
    let grooved = |n: NodeId| if is_bottom_of_groove(mesh.point(n)) { [0.0, 0.0, -0.3] } else { [0.0; 3] };
    let lowered: Vec<Point> = mesh.topology().nodes().map(grooved).collect();
    let grooved = mesh.moved(&lowered).expect("no element is inverted");
    let slab = mesh.topology().region("slab").expect("it has one");
    // Chosen on the flat one: the sides of the groove look up as well.
    let triangles: Vec<[NodeId; 3]> = mesh
        .topology()
        .boundary(slab)
        .into_iter()
        .filter(|face| [0.2, 1.2].iter().any(|z| face.iter().all(|n| mesh.point(*n)[2] == *z)))
        .collect();
    let surface = DesignSurface::new(&grooved, &DesignSetup::new(&triangles, Direction::Normal))
        .expect("every node is a variable");
    let at_groove = |place: usize| is_bottom_of_groove(mesh.point(surface.nodes()[place]));
    assert!((0..surface.nodes().len()).any(|place| at_groove(place) && surface.mitres()[place] != 1.0));
    let thickness = WallThickness::measure(&grooved, &[slab], &surface).expect("it has two faces");
    for (place, least) in thickness.least_at_nodes(|n| grooved.point(n)) {
        if at_groove(place) {
            assert!((least - 0.7).abs() < 1e-12, "{least}");
        }
    }
}

/// The wall behind a node that moves along z over a plane, which leans by as much as it likes.
#[test]
fn a_plane_that_leans_and_moves_along_its_normal_is_as_far_as_along_the_ray() {
    let slope = 0.7_f64;
    let corners = [[-1.0, -1.0, -slope], [1.0, -1.0, slope], [0.0, 2.0, 0.0]];
    let (origin, direction) = ([0.1, 0.2, 1.5], [0.0, 0.0, 1.0]);
    let met = hit(origin, [0.0, 0.0, -1.0], &corners).expect("it lies below");
    assert!((met.distance - (1.5 - 0.1 * slope)).abs() < 1e-15, "{}", met.distance);
    let opposite = Opposite::new(NodeId(0), &met, direction, ([1, 2, 3].map(NodeId), RegionId(0)));
    let unit = met.normal.map(|c| c / norm(met.normal));
    let moved = |n: NodeId| match n.index() {
        0 => origin,
        k => std::array::from_fn(|d| corners[k - 1][d] - 0.3 * unit[d] * unit[2].signum()),
    };
    let thickness = wall(&opposite, &moved).thickness;
    let expected = met.distance + 0.3 * (1.0 + slope * slope).sqrt();
    assert!((thickness - expected).abs() < 1e-14, "{thickness} {expected}");
}

#[test]
fn a_wall_has_its_derivative_in_all_four_nodes_and_none_by_the_turn_of_a_triangle() {
    let places = [[0.2, 0.1, 1.1], [-0.4, -0.3, 0.1], [1.2, -0.1, 0.2], [0.1, 1.3, -0.1]];
    let growth = [0.1, -0.2, 1.1];
    let nodes = [1, 2, 3].map(NodeId);
    let weights = [0.5, 0.2, 0.3];
    let corners = [0, 1, 2, 3].map(NodeId).map(Corner::Node);
    let body = RegionId(0);
    let opposite = Opposite { distance: 1.0, corners, face: nodes, weights, growth, body, bulge: None };
    let at = |places: &[Point; 4]| wall(&opposite, &|n| places[n.index()]);
    for (k, own) in at(&places).derivatives.into_iter().enumerate() {
        let (own, derivative) = own.expect("a node");
        assert_eq!(own, NodeId::new(k));
        for d in 0..3 {
            let shifted = |h: f64| {
                let mut moved = places;
                moved[k][d] += h;
                at(&moved).thickness
            };
            // It is linear: over a step of one, rounding of numbers of order one.
            let difference = shifted(0.5) - shifted(-0.5);
            assert!((derivative[d] - difference).abs() < 1e-14, "{k} {d}: {} {difference}", derivative[d]);
        }
    }
    // Across the plane that the triangle had, until it is seen from behind.
    let across = [0.0, 1.1, 0.2];
    let mut turned = places;
    turned[1] = std::array::from_fn(|d| places[1][d] + 20.0 * across[d]);
    let [was, is] = [places, turned].map(|places| at(&places).thickness);
    // One rounding of numbers of order 20.
    assert!((was - is).abs() < 1e-14, "{was} {is}");
}
