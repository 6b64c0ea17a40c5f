//! Gmsh files of random meshes in every form that is read, written here without the library's own writer.

#![allow(dead_code, unreachable_pub, reason = "every binary uses its part; the fuzz targets share theirs")]

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use fluxmorph_geometry::generate::{BlockParameters, block};
use fluxmorph_geometry::tet4::{FACES, Point, volume};
use fluxmorph_geometry::{Mesh, NodeId, RegionId, Topology};

#[path = "../../../../fuzz/src/mesh.rs"]
pub(crate) mod fuzzed;
pub(crate) use fuzzed::Form;

/// A small deterministic source of numbers (splitmix64, Steele et al. 2014).
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub(crate) fn below(&mut self, limit: u64) -> u64 {
        self.next() % limit
    }

    /// From 0 to 1.
    pub(crate) fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// The versions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Version {
    V2,
    V4,
}

/// A mesh as a file holds it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Device {
    /// Tag and coordinates in the unit of the file.
    pub(crate) nodes: Vec<(u64, Point)>,
    /// Tag, node tags, physical tag.
    pub(crate) tets: Vec<(u64, [u64; 4], i32)>,
    /// Tag, node tags, physical tags.
    pub(crate) triangles: Vec<(u64, [u64; 3], Vec<i32>)>,
    /// Dimension, tag, name.
    pub(crate) names: Vec<(i32, i32, String)>,
}

/// Two tetrahedra in two volumes with a triangle between them, in version 4.1.
pub(crate) const SOUND_V4: &str = include_str!("sound_v4.msh");

/// The same in version 2.2.
pub(crate) const SOUND_V2: &str = include_str!("sound_v2.msh");

impl Device {
    /// The mesh of [`SOUND_V4`], with other tags of the volumes.
    pub(crate) fn two_tets() -> Self {
        let nodes = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0; 3]];
        let names = [(2, 1, "face"), (3, 7, "left"), (3, 8, "right")];
        Self {
            nodes: (1..).zip(nodes).collect(),
            tets: vec![(2, [1, 2, 3, 4], 7), (3, [5, 2, 4, 3], 8)],
            triangles: vec![(1, [2, 3, 4], vec![1])],
            names: names.map(|(dimension, tag, name)| (dimension, tag, name.to_owned())).to_vec(),
        }
    }

    /// A block of some cells with crooked nodes, random tags, regions and surfaces.
    pub(crate) fn random(random: &mut Random, tag_limit: u64) -> Self {
        let cells = [0; 3].map(|_| 1 + random.below(3) as usize);
        let grid = block(&BlockParameters { size: cells.map(|n| n as f64), cells }).expect("a block");
        let mut used = BTreeSet::new();
        let mut tag = |random: &mut Random| loop {
            let tag = 1 + random.below(tag_limit);
            if used.insert(tag) {
                break tag;
            }
        };
        // A tenth of a cell off the grid keeps all volumes positive.
        let crooked = |x: &Point, random: &mut Random| x.map(|c| c + 0.1 * (random.unit() - 0.5));
        let nodes: Vec<_> = grid.points().iter().map(|x| (tag(random), crooked(x, random))).collect();
        let groups = 1 + random.below(3);
        let mut element = 0;
        let mut tets = Vec::new();
        for tet in grid.topology().tets() {
            element += 1 + random.below(5);
            tets.push((element, tet.map(|n| nodes[n.index()].0), 7 + random.below(groups) as i32));
        }
        let mut triangles = Vec::new();
        for &(_, tet, _) in &tets {
            for face in FACES {
                let nodes = face.map(|v| tet[v]);
                let mut key = nodes;
                key.sort_unstable();
                let new = triangles.iter().all(|(_, other, _): &(u64, [u64; 3], _)| {
                    let mut other = *other;
                    other.sort_unstable();
                    other != key
                });
                if new && random.below(3) == 0 {
                    let mut groups: Vec<i32> = (1..=3).filter(|_| random.below(2) == 0).collect();
                    if groups.is_empty() {
                        groups.push(1 + random.below(3) as i32);
                    }
                    element += 1 + random.below(5);
                    triangles.push((element, nodes, groups));
                }
            }
        }
        let mut names = Vec::new();
        for tag in 1..=3 {
            if random.below(3) > 0 {
                names.push((2, tag, format!("Fläche {tag}")));
            }
        }
        for tag in 7..10 {
            if random.below(3) > 0 {
                names.push((3, tag, format!("region {tag}")));
            }
        }
        Self { nodes, tets, triangles, names }
    }

    /// What a reader must make of it.
    pub(crate) fn mesh(&self, scale: impl Fn(f64) -> f64) -> Mesh {
        let mut nodes = self.nodes.clone();
        nodes.sort_by_key(|node| node.0);
        let position: BTreeMap<u64, NodeId> =
            nodes.iter().enumerate().map(|(i, node)| (node.0, NodeId::new(i))).collect();
        let named = |dimension, tag| {
            let name = self.names.iter().find(|n| (n.0, n.1) == (dimension, tag)).map(|n| n.2.clone());
            let kind = if dimension == 3 { "volume" } else { "surface" };
            name.unwrap_or_else(|| format!("{kind}_{tag}"))
        };
        let used = |dimension, tags: Vec<i32>| {
            let mut all: Vec<i32> =
                self.names.iter().filter(|n| n.0 == dimension).map(|n| n.1).chain(tags).collect();
            all.sort_unstable();
            all.dedup();
            all
        };
        let regions = used(3, self.tets.iter().map(|t| t.2).collect());
        let mut tets = self.tets.clone();
        tets.sort_by_key(|tet| tet.0);
        let topology = Topology::new(
            nodes.len(),
            tets.iter().map(|tet| tet.1.map(|n| position[&n])).collect(),
            regions.iter().map(|&tag| named(3, tag)).collect(),
            tets.iter().map(|t| RegionId::new(regions.binary_search(&t.2).expect("used"))).collect(),
        );
        let mut topology = topology.expect("a mesh");
        let mut triangles = self.triangles.clone();
        triangles.sort_by_key(|t| t.0);
        for tag in used(2, self.triangles.iter().flat_map(|t| t.2.clone()).collect()) {
            let of =
                triangles.iter().filter(|t| t.2.contains(&tag)).map(|t| t.1.map(|n| position[&n])).collect();
            topology = topology.with_surface(&named(2, tag), of).expect("nodes are there");
        }
        let points: Vec<Point> = nodes.iter().map(|n| n.1.map(&scale)).collect();
        let mesh = Mesh::new(Arc::new(topology), points).expect("right-handed");
        assert!(mesh.topology().elements().all(|e| volume(mesh.vertices(e)) > 0.0));
        mesh
    }

    /// The bytes of a file.
    pub(crate) fn bytes(&self, version: Version, form: Form) -> Vec<u8> {
        let mut out = Writer { bytes: Vec::new(), form };
        out.header(version);
        if !self.names.is_empty() {
            out.line(&format!("$PhysicalNames\n{}", self.names.len()));
            for (dimension, tag, name) in &self.names {
                out.line(&format!("{dimension} {tag} \"{name}\""));
            }
            out.line("$EndPhysicalNames");
        }
        match version {
            Version::V2 => self.version2(&mut out),
            Version::V4 => self.version4(&mut out),
        }
        out.bytes
    }

    fn version2(&self, out: &mut Writer) {
        out.line(&format!("$Nodes\n{}", self.nodes.len()));
        for (tag, x) in &self.nodes {
            out.ints(&[*tag as i32]).reals(x).end();
        }
        out.end_section("Nodes");
        let elements: Vec<(u64, i32, Vec<u64>, i32)> = self
            .triangles
            .iter()
            .flat_map(|(tag, nodes, groups)| groups.iter().map(|&group| (*tag, 2, nodes.to_vec(), group)))
            .chain(self.tets.iter().map(|(tag, nodes, group)| (*tag, 4, nodes.to_vec(), *group)))
            .collect();
        out.line(&format!("$Elements\n{}", elements.len()));
        for block in elements.chunk_by(|a, b| a.1 == b.1) {
            if out.form != Form::Ascii {
                out.ints(&[block[0].1, block.len() as i32, 2]);
            }
            for (tag, code, nodes, group) in block {
                out.ints(&[*tag as i32]);
                if out.form == Form::Ascii {
                    out.ints(&[*code, 2]);
                }
                out.ints(&[*group, *group]);
                let nodes: Vec<i32> = nodes.iter().map(|&n| n as i32).collect();
                out.ints(&nodes).end();
            }
        }
        out.end_section("Elements");
    }

    fn version4(&self, out: &mut Writer) {
        let mut surfaces: Vec<Vec<i32>> = self.triangles.iter().map(|t| t.2.clone()).collect();
        surfaces.sort();
        surfaces.dedup();
        let mut volumes: Vec<i32> = self.tets.iter().map(|t| t.2).collect();
        volumes.sort_unstable();
        volumes.dedup();
        out.line("$Entities");
        out.sizes(&[1, 0, surfaces.len() as u64, volumes.len() as u64]).end();
        out.ints(&[1]).reals(&[0.0; 3]).sizes(&[0]).end();
        let groups = surfaces.iter().cloned().chain(volumes.iter().map(|&group| vec![group]));
        for (i, groups) in groups.enumerate() {
            out.ints(&[if i < surfaces.len() { i + 1 } else { i - surfaces.len() + 1 } as i32]);
            out.reals(&[0.0; 6]).sizes(&[groups.len() as u64]).ints(&groups).sizes(&[0]).end();
        }
        out.end_section("Entities");
        out.line("$Nodes");
        let half = self.nodes.len() / 2;
        out.sizes(&[2, self.nodes.len() as u64, 1, 9]).end();
        for (dimension, nodes) in [(2, &self.nodes[..half]), (3, &self.nodes[half..])] {
            out.ints(&[dimension, 1, 0]).sizes(&[nodes.len() as u64]).end();
            nodes.iter().for_each(|(tag, _)| out.sizes(&[*tag]).end());
            nodes.iter().for_each(|(_, x)| out.reals(x).end());
        }
        out.end_section("Nodes");
        out.line("$Elements");
        let count = self.tets.len() + self.triangles.len();
        out.sizes(&[(surfaces.len() + volumes.len()) as u64, count as u64, 1, 9]).end();
        for (i, groups) in surfaces.iter().enumerate() {
            let of: Vec<_> = self.triangles.iter().filter(|t| t.2 == *groups).collect();
            out.ints(&[2, i as i32 + 1, 2]).sizes(&[of.len() as u64]).end();
            of.into_iter().for_each(|(tag, nodes, _)| out.sizes(&[*tag]).sizes(nodes).end());
        }
        for (i, group) in volumes.iter().enumerate() {
            let of: Vec<_> = self.tets.iter().filter(|t| t.2 == *group).collect();
            out.ints(&[3, i as i32 + 1, 4]).sizes(&[of.len() as u64]).end();
            of.into_iter().for_each(|(tag, nodes, _)| out.sizes(&[*tag]).sizes(nodes).end());
        }
        out.end_section("Elements");
    }
}

/// Numbers in the form of a file.
pub(crate) struct Writer {
    pub(crate) bytes: Vec<u8>,
    pub(crate) form: Form,
}

impl Writer {
    pub(crate) fn line(&mut self, text: &str) {
        self.bytes.extend(text.as_bytes());
        self.bytes.push(b'\n');
    }

    pub(crate) fn header(&mut self, version: Version) {
        let version = if version == Version::V2 { "2.2" } else { "4.1" };
        self.bytes.extend(fuzzed::with_header(version, self.form, &[]));
    }

    fn number<const N: usize>(&mut self, text: String, little: [u8; N]) {
        match self.form {
            Form::Ascii => self.bytes.extend(format!("{text} ").as_bytes()),
            Form::Little => self.bytes.extend(little),
            Form::Big => self.bytes.extend(little.iter().rev()),
        }
    }

    pub(crate) fn ints(&mut self, values: &[i32]) -> &mut Self {
        values.iter().for_each(|n| self.number(n.to_string(), n.to_le_bytes()));
        self
    }

    pub(crate) fn sizes(&mut self, values: &[u64]) -> &mut Self {
        values.iter().for_each(|n| self.number(n.to_string(), n.to_le_bytes()));
        self
    }

    pub(crate) fn reals(&mut self, values: &[f64]) -> &mut Self {
        values.iter().for_each(|x| self.number(format!("{x:e}"), x.to_le_bytes()));
        self
    }

    pub(crate) fn end(&mut self) {
        if self.form == Form::Ascii {
            self.bytes.push(b'\n');
        }
    }

    pub(crate) fn end_section(&mut self, name: &str) {
        if self.form != Form::Ascii {
            self.bytes.push(b'\n');
        }
        self.line(&format!("$End{name}"));
    }
}

/// Asserts that two meshes agree to the bit.
#[track_caller]
pub(crate) fn assert_same(a: &Mesh, b: &Mesh) {
    let bits = |mesh: &Mesh| -> Vec<u64> { mesh.points().iter().flatten().map(|x| x.to_bits()).collect() };
    assert_eq!(bits(a), bits(b));
    let (a, b) = (a.topology(), b.topology());
    assert_eq!(a.tets(), b.tets());
    assert_eq!(a.region_names(), b.region_names());
    assert_eq!(a.region_of(), b.region_of());
    let names = |t: &Topology| t.surface_names().map(str::to_owned).collect::<Vec<_>>();
    assert_eq!(names(a), names(b));
    for name in a.surface_names() {
        assert_eq!(a.surface(name).expect("named"), b.surface(name).expect("named"), "{name}");
    }
}
