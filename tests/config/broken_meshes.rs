//! Meshes that are broken although every element of them is sound: each is refused, or told of, before a field is computed.
//!
//! Every kind of damage is done to three sound devices from Gmsh. What is only told is told by a warning that names it.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use fluxmorph::build::{Mode, set_up};
use fluxmorph::config::Config;
use fluxmorph_geometry::io::read_msh_file;
use fluxmorph_geometry::tet4::{Point, add, centroid, norm, sub};

use crate::msh_support::{Device, Form, Random, Version};
use crate::support::program::folder;
use crate::support::{changed, repository, repository_text};

/// A sound device: its configuration, its mesh, the key of the mesh file as written, and the names that the damage is done to.
struct Sound {
    config: &'static str,
    mesh: &'static str,
    file: &'static str,
    /// A body of iron.
    body: &'static str,
    /// The region around all others.
    air: &'static str,
    /// A surface with a condition, curved and outer.
    outer: &'static str,
    /// The surface that is designed.
    design: &'static str,
}

static DEVICES: [Sound; 3] = [
    Sound {
        config: "configs/inductor.toml",
        mesh: "configs/meshes/inductor.msh",
        file: "meshes/inductor.msh",
        body: "core",
        air: "air",
        outer: "outer",
        design: "end_face",
    },
    Sound {
        config: "docs/device/concentrator.toml",
        mesh: "docs/device/concentrator.msh",
        file: "concentrator.msh",
        body: "slug",
        air: "air",
        outer: "outer",
        design: "slug_side",
    },
    Sound {
        config: "crates/app/templates/gmsh.toml",
        mesh: "crates/app/templates/gmsh.msh",
        file: "NAME.msh",
        body: "tip",
        air: "air",
        outer: "outer",
        design: "face",
    },
];

/// A mesh file's content with what is known of the device.
struct Mesh {
    device: Device,
    of: &'static Sound,
    unit: &'static str,
}

/// A kind of damage: its name, how it is done, and what must be said, one of several.
type Kind = (&'static str, fn(&mut Mesh), &'static [&'static str]);

const KINDS: &[Kind] = &[
    ("a hole in the air", |m| m.drop_inside(m.of.air), &["the wall of a hole"]),
    ("a hole in the iron", |m| m.drop_inside(m.of.body), &["the wall of a hole"]),
    ("elements lost at the outer side", Mesh::drop_at_outside, &["faces of no tetrahedron"]),
    (
        "elements and triangles lost at the outer side",
        Mesh::dent,
        &["stands into the mesh", "whose rest has a condition"],
    ),
    ("a region that was not meshed", Mesh::drop_body, &["faces of no tetrahedron", "has no elements"]),
    ("a node moved through its neighbours", |m| m.displace(1, 3.0), &["same side of a common face"]),
    ("a tangled mesh", |m| m.displace(40, 1.5), &["same side of a common face"]),
    ("two nodes exchanged", Mesh::exchange, &["same side of a common face"]),
    ("a body without common nodes", |m| drop(m.unshare()), &["touch without common nodes"]),
    ("a cut through the air", Mesh::cut, &["its two sides touch without common nodes"]),
    ("one doubled node", Mesh::double_one, &["touch without common nodes"]),
    ("a body turned in its seat", Mesh::turn_body, &["overlap", "touch without common nodes"]),
    ("a body shrunk in its seat", Mesh::shrink_body, &["have no face in common"]),
    ("a body meshed twice at one place", |m| m.copy_body(0.0), &["overlap"]),
    ("a body meshed twice, shifted", |m| m.copy_body(0.5), &["overlap"]),
    ("a body that was not cut out of the air", Mesh::fill_body, &["overlap"]),
    ("a part far away", |m| m.copy_body(1000.0), &["parts that share no node"]),
    ("half of the outer triangles missing", |m| m.thin_out(0.5), &["whose rest has a condition"]),
    ("some of the outer triangles missing", |m| m.thin_out(0.02), &["whose rest has a condition"]),
    ("the outer surface missing", |m| m.thin_out(2.0), &["there is no surface", "has no triangles"]),
    ("the outer and the designed surface swapped", Mesh::swap_surfaces, &["has faces inside the mesh"]),
    (
        "the iron and the air swapped",
        Mesh::swap_regions,
        &["swapped", "the current of the coil `coil` flows inside"],
    ),
    ("metres for millimetres", |m| m.unit = "m", &["check mesh.unit"]),
];

#[test]
fn no_broken_mesh_is_solved_in_silence() {
    let mut silent = Vec::new();
    let mut counts = BTreeMap::new();
    for (of, (name, damage, says)) in DEVICES.iter().flat_map(|of| KINDS.iter().map(move |kind| (of, kind))) {
        let mut mesh = Mesh { device: read(of), of, unit: "mm" };
        damage(&mut mesh);
        let (refused, text) = outcome(&mesh);
        *counts.entry(refused).or_insert(0) += 1;
        if !says.iter().any(|part| text.contains(part)) {
            silent.push(format!("{name}, {}: {text}", of.config));
        }
    }
    println!("{} broken meshes: {counts:?} (refused or not)", DEVICES.len() * KINDS.len());
    assert!(silent.is_empty(), "{}", silent.join("\n\n"));
}

#[test]
fn orientation_alone_is_repaired() {
    for of in &DEVICES {
        let mut mesh = Mesh { device: read(of), of, unit: "mm" };
        let (refused, said) = outcome(&mesh);
        assert!(!refused, "{}: {said}", of.config);
        mesh.device.tets.iter_mut().step_by(3).for_each(|tet| tet.1.swap(0, 1));
        let turned = mesh.device.tets.len().div_ceil(3);
        let (refused, text) = outcome(&mesh);
        let notices: Vec<&str> = text.lines().filter(|line| !said.contains(line)).collect();
        assert!(!refused && notices.len() == 1, "{}: {text}", of.config);
        assert!(
            notices[0].ends_with(&format!("{turned} left-handed tetrahedra are turned around")),
            "{text}"
        );
    }
}

/// The device of a shipped mesh file, in the file's unit.
fn read(of: &'static Sound) -> Device {
    let mesh = read_msh_file(&repository(of.mesh), 1.0).unwrap_or_else(|error| panic!("{error}")).mesh;
    let topology = mesh.topology();
    let tag = |i: usize| i as i32 + 1;
    let regions = topology.region_names().iter().enumerate().map(|(i, name)| (3, tag(i), name.clone()));
    let surfaces = topology.surface_names().enumerate().map(|(i, name)| (2, tag(i), name.to_owned()));
    let nodes = |tags: &[fluxmorph_geometry::NodeId]| -> Vec<u64> {
        tags.iter().map(|n| u64::from(n.0) + 1).collect()
    };
    let triangles = topology.surface_names().enumerate().flat_map(|(i, name)| {
        let of = topology.surface(name).expect("its own name");
        of.iter().map(move |t| (t.map(|n| u64::from(n.0) + 1), vec![tag(i)]))
    });
    let triangles: Vec<_> = triangles.collect();
    let first = triangles.len() as u64 + 1;
    let tets = topology.tets().iter().zip(topology.region_of()).zip(first..);
    Device {
        nodes: (1..).zip(mesh.points().iter().copied()).collect(),
        tets: tets
            .map(|((tet, region), own)| (own, nodes(tet).try_into().expect("four"), tag(region.index())))
            .collect(),
        triangles: (1..).zip(triangles).map(|(own, (nodes, groups))| (own, nodes, groups)).collect(),
        names: regions.chain(surfaces).collect(),
    }
}

/// Whether a mesh is refused, and all that is said of it: errors, or warnings.
fn outcome(mesh: &Mesh) -> (bool, String) {
    let home = folder();
    let text = changed(
        &repository_text(mesh.of.config),
        &[
            (&format!("file = \"{}\"", mesh.of.file), "file = \"device.msh\""),
            ("unit = \"mm\"", &format!("unit = \"{}\"", mesh.unit)),
        ],
    );
    std::fs::write(home.path().join("device.toml"), text).expect("written");
    let bytes = mesh.device.bytes(Version::V2, Form::Little);
    std::fs::write(home.path().join("device.msh"), bytes).expect("written");
    problem(&home.path().join("device.toml"))
}

fn problem(config: &Path) -> (bool, String) {
    let (config, source) = Config::from_file(config, &[]).unwrap_or_else(|error| panic!("{error}"));
    match set_up(&config, &source, Mode::Analysis) {
        Ok(setup) => (false, setup.warnings.join("\n")),
        Err(error) => (true, error.to_string()),
    }
}

fn sorted(mut face: [u64; 3]) -> [u64; 3] {
    face.sort_unstable();
    face
}

/// The faces of a tetrahedron, each with its nodes ascending.
fn faces(tet: &[u64; 4]) -> [[u64; 3]; 4] {
    [0, 1, 2, 3].map(|k| sorted([0, 1, 2].map(|i| tet[(k + i) % 4])))
}

impl Mesh {
    fn group(&self, dimension: i32, name: &str) -> i32 {
        let of = self.device.names.iter().find(|n| n.0 == dimension && n.2 == name);
        of.unwrap_or_else(|| panic!("no group {name}")).1
    }

    fn point(&self, node: u64) -> Point {
        self.device.nodes[node as usize - 1].1
    }

    fn middle(&self, tet: &[u64; 4]) -> Point {
        centroid(tet.map(|n| self.point(n)))
    }

    /// Nodes of elements of a region.
    fn nodes_of(&self, region: &str) -> BTreeSet<u64> {
        let group = self.group(3, region);
        self.device.tets.iter().filter(|t| t.2 == group).flat_map(|t| t.1).collect()
    }

    /// Nodes of a region whose elements are all of it, and which lie in no surface.
    fn inner_nodes(&self, region: &str) -> Vec<u64> {
        let group = self.group(3, region);
        let others = self.device.tets.iter().filter(|t| t.2 != group).flat_map(|t| t.1);
        let surfaces = self.device.triangles.iter().flat_map(|t| t.1);
        // Outer faces of no surface, too: those of one element alone.
        let mut counts: BTreeMap<[u64; 3], usize> = BTreeMap::new();
        for face in self.device.tets.iter().flat_map(|tet| faces(&tet.1)) {
            *counts.entry(face).or_default() += 1;
        }
        let hull = counts.into_iter().filter(|(_, count)| *count == 1).flat_map(|(face, _)| face);
        let taken: BTreeSet<u64> = others.chain(surfaces).chain(hull).collect();
        self.nodes_of(region).difference(&taken).copied().collect()
    }

    /// An inner node of a region, always the same.
    fn inner_node(&self, region: &str) -> u64 {
        let nodes = self.inner_nodes(region);
        nodes[nodes.len() / 2]
    }

    /// Takes the innermost element of a region out.
    fn drop_inside(&mut self, region: &str) {
        let (group, inner) = (self.group(3, region), self.inner_nodes(region));
        let depth = |t: &(u64, [u64; 4], i32)| t.1.iter().filter(|n| inner.contains(n)).count();
        let own = self.device.tets.iter().filter(|t| t.2 == group);
        let tag = own.max_by_key(|t| depth(t)).expect("a region has elements").0;
        self.device.tets.retain(|t| t.0 != tag);
    }

    /// A node of the outer surface that is none of another.
    fn outer_node(&self) -> u64 {
        let group = self.group(2, self.of.outer);
        let of = |outer: bool| -> BTreeSet<u64> {
            let own = self.device.triangles.iter().filter(|t| t.2.contains(&group) == outer);
            own.flat_map(|t| t.1).collect()
        };
        let nodes: Vec<u64> = of(true).difference(&of(false)).copied().collect();
        nodes[nodes.len() / 2]
    }

    fn drop_at_outside(&mut self) {
        let node = self.outer_node();
        self.device.tets.retain(|t| !t.1.contains(&node));
    }

    fn dent(&mut self) {
        let node = self.outer_node();
        self.device.tets.retain(|t| !t.1.contains(&node));
        self.device.triangles.retain(|t| !t.1.contains(&node));
    }

    fn drop_body(&mut self) {
        let group = self.group(3, self.of.body);
        self.device.tets.retain(|t| t.2 != group);
    }

    /// Moves some inner nodes of the air by so many of their distances to a neighbour.
    fn displace(&mut self, count: usize, by: f64) {
        let nodes = self.inner_nodes(self.of.air);
        let mut random = Random(7);
        for k in 0..count.min(nodes.len()) {
            let node = nodes[(k * 7919) % nodes.len()];
            let tet =
                self.device.tets.iter().find(|t| t.1.contains(&node)).expect("an inner node has elements");
            let other = tet.1.into_iter().find(|n| *n != node).expect("three others");
            let length = by * norm(sub(self.point(other), self.point(node)));
            let way = [0; 3].map(|_| random.unit() - 0.5);
            let place = add(self.point(node), way.map(|c| c * length / norm(way)));
            self.device.nodes[node as usize - 1].1 = place;
        }
    }

    fn exchange(&mut self) {
        let nodes = self.inner_nodes(self.of.air);
        let (a, b) = (nodes[0] as usize - 1, nodes[nodes.len() - 1] as usize - 1);
        let place = self.device.nodes[a].1;
        self.device.nodes[a].1 = self.device.nodes[b].1;
        self.device.nodes[b].1 = place;
    }

    /// Gives some elements nodes of their own, at the places of the old ones.
    fn own_nodes(&mut self, elements: &BTreeSet<usize>) -> BTreeSet<u64> {
        let mut copies: BTreeMap<u64, u64> = BTreeMap::new();
        let others = (0..self.device.tets.len()).filter(|e| !elements.contains(e));
        let kept: BTreeSet<[u64; 3]> = others.flat_map(|e| faces(&self.device.tets[e].1)).collect();
        let own: BTreeSet<[u64; 3]> = elements.iter().flat_map(|&e| faces(&self.device.tets[e].1)).collect();
        for &e in elements {
            for k in 0..4 {
                let old = self.device.tets[e].1[k];
                let new = *copies.entry(old).or_insert_with(|| {
                    let tag = self.device.nodes.len() as u64 + 1;
                    let place = self.device.nodes[old as usize - 1].1;
                    self.device.nodes.push((tag, place));
                    tag
                });
                self.device.tets[e].1[k] = new;
            }
        }
        // Triangles follow the elements that they are faces of, if those alone have them.
        for triangle in &mut self.device.triangles {
            let face = sorted(triangle.1);
            if own.contains(&face) && !kept.contains(&face) {
                triangle.1 = triangle.1.map(|n| copies[&n]);
            }
        }
        copies.into_values().collect()
    }

    fn elements(&self, is_one: impl Fn(&(u64, [u64; 4], i32)) -> bool) -> BTreeSet<usize> {
        (0..self.device.tets.len()).filter(|&e| is_one(&self.device.tets[e])).collect()
    }

    fn body(&self) -> BTreeSet<usize> {
        let group = self.group(3, self.of.body);
        self.elements(|t| t.2 == group)
    }

    fn unshare(&mut self) -> BTreeSet<u64> {
        let body = self.body();
        // The triangles stay with the other side.
        self.own_nodes(&body)
    }

    fn cut(&mut self) {
        let group = self.group(3, self.of.air);
        let node = self.inner_node(self.of.air);
        let [_, _, level] = self.point(node);
        let near = |m: &Self, t: &[u64; 4]| t.contains(&node) && m.middle(t)[2] > level;
        let upper = self.elements(|t| t.2 == group && near(self, &t.1));
        self.own_nodes(&upper);
        // The rim of the cut is common: only the node in its middle is two.
        let kept: BTreeSet<u64> = upper.iter().flat_map(|&e| self.device.tets[e].1).collect();
        let same = |a: u64, b: u64| norm(sub(self.point(a), self.point(b))) == 0.0;
        let old: Vec<(u64, u64)> = kept
            .iter()
            .filter_map(|&new| {
                let old = (1..self.device.nodes.len() as u64).find(|&old| old < new && same(old, new))?;
                (old != node).then_some((new, old))
            })
            .collect();
        for (new, old) in old {
            let tets = self.device.tets.iter_mut().flat_map(|t| &mut t.1);
            let triangles = self.device.triangles.iter_mut().flat_map(|t| &mut t.1);
            tets.chain(triangles).filter(|n| **n == new).for_each(|n| *n = old);
        }
    }

    /// A node at the body's side that the air's elements have twice.
    fn double_one(&mut self) {
        let (body, group) = (self.nodes_of(self.of.body), self.group(3, self.of.body));
        let beside =
            self.device.tets.iter().filter(|t| t.2 != group).flat_map(|t| t.1).find(|n| body.contains(n));
        let node = beside.expect("the body has a side");
        let tag = self.device.nodes.len() as u64 + 1;
        self.device.nodes.push((tag, self.point(node)));
        for tet in self.device.tets.iter_mut().filter(|t| t.2 == group) {
            tet.1.iter_mut().filter(|n| **n == node).for_each(|n| *n = tag);
        }
    }

    fn turn_body(&mut self) {
        let (sine, cosine) = 0.05f64.sin_cos();
        for node in self.unshare() {
            let place = &mut self.device.nodes[node as usize - 1].1;
            let [x, y, z] = *place;
            *place = [cosine * x - sine * y, sine * x + cosine * y, z];
        }
    }

    fn shrink_body(&mut self) {
        let nodes = self.unshare();
        let places: Vec<Point> = nodes.iter().map(|&n| self.point(n)).collect();
        let middle: Point =
            std::array::from_fn(|d| places.iter().map(|p| p[d]).sum::<f64>() / places.len() as f64);
        for node in nodes {
            let place = &mut self.device.nodes[node as usize - 1].1;
            *place = std::array::from_fn(|d| middle[d] + 0.97 * (place[d] - middle[d]));
        }
    }

    /// The body a second time, shifted by a multiple of its own length along z.
    fn copy_body(&mut self, by: f64) {
        let copies: Vec<_> = self.body().into_iter().map(|e| self.device.tets[e]).collect();
        let first = self.device.tets.len();
        let tag = self.device.tets.iter().map(|t| t.0).max().expect("elements");
        self.device.tets.extend((tag + 1..).zip(copies).map(|(tag, (_, nodes, group))| (tag, nodes, group)));
        let nodes = self.own_nodes(&(first..self.device.tets.len()).collect());
        let heights = || nodes.iter().map(|&n| self.point(n)[2]);
        let length = heights().fold(f64::MIN, f64::max) - heights().fold(f64::MAX, f64::min);
        for node in nodes {
            self.device.nodes[node as usize - 1].1[2] += by * length;
        }
    }

    /// The body a second time, as coarse air: its box.
    fn fill_body(&mut self) {
        let places: Vec<Point> = self.nodes_of(self.of.body).into_iter().map(|n| self.point(n)).collect();
        let limit =
            |d: usize, most: fn(f64, f64) -> f64| places.iter().map(|p| p[d]).reduce(most).expect("nodes");
        let (low, high) = ([0, 1, 2].map(|d| limit(d, f64::min)), [0, 1, 2].map(|d| limit(d, f64::max)));
        let first = self.device.nodes.len() as u64 + 1;
        for corner in 0..8u64 {
            let place = std::array::from_fn(|d| if corner >> d & 1 == 0 { low[d] } else { high[d] });
            self.device.nodes.push((first + corner, place));
        }
        let group = self.group(3, self.of.air);
        let tag = self.device.tets.iter().map(|t| t.0).max().expect("elements") + 1;
        // The six Kuhn cells of a box, about its diagonal.
        let cells = [[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]];
        self.device.tets.extend((tag..).zip(cells).map(|(tag, cell)| (tag, cell.map(|c| first + c), group)));
    }

    /// Takes a share of the triangles out of the outer surface; a share above one takes its name, too.
    fn thin_out(&mut self, share: f64) {
        let group = self.group(2, self.of.outer);
        let own: Vec<u64> = self.device.triangles.iter().filter(|t| t.2 == [group]).map(|t| t.0).collect();
        let count = (share * own.len() as f64).ceil() as usize;
        let taken: BTreeSet<u64> = own.into_iter().take(count).collect();
        self.device.triangles.retain(|t| !taken.contains(&t.0));
        if share > 1.0 {
            self.device.names.retain(|n| (n.0, n.1) != (2, group));
        }
    }

    fn swap_surfaces(&mut self) {
        let (a, b) = (self.group(2, self.of.outer), self.group(2, self.of.design));
        self.swap(2, a, b);
    }

    fn swap_regions(&mut self) {
        let (a, b) = (self.group(3, self.of.body), self.group(3, self.of.air));
        self.swap(3, a, b);
    }

    fn swap(&mut self, dimension: i32, a: i32, b: i32) {
        for name in self.device.names.iter_mut().filter(|n| n.0 == dimension) {
            name.1 = if name.1 == a {
                b
            } else if name.1 == b {
                a
            } else {
                name.1
            };
        }
    }
}
