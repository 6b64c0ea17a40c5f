//! The mesh of a configuration with its cells divided where the device is.

use std::collections::BTreeSet;
use std::sync::Arc;

use fluxmorph_geometry::generate::{
    BoxesParameters, Division, ShieldParameters, SphereParameters, boxes, shield, sphere,
};
use fluxmorph_geometry::locate::locate;
use fluxmorph_geometry::tet4::{Point, centroid, norm, sub};
use fluxmorph_geometry::{Mesh, MeshError};
use fluxmorph_optimizer::problem::Problem;

use super::mesh::{build, named_interfaces};
use super::open;
use super::references::{body_of, expansion_of, functionals, region_in_mesh};
use crate::config::{Config, MeshConfig, SourceMap};
use crate::error::Error;

/// Parameters of a generated mesh whose cells are divided.
#[derive(Clone, Debug)]
pub(crate) enum DividedMesh {
    Shield(ShieldParameters),
    Boxes(BoxesParameters),
    /// Refined as a whole, with the growth of its far cells kept.
    Sphere(SphereParameters),
}

impl DividedMesh {
    /// With every cell that moves or is observed in so many parts along each axis; `None` for a mesh from a file, for one
    /// of the generator `block`, and where nothing moves.
    pub(crate) fn of(config: &Config, problem: &Problem, parts: usize) -> Option<Self> {
        let division = Some(Division { inside: device(config, problem)?, parts });
        match &config.mesh {
            MeshConfig::Shield(mesh) => {
                Some(Self::Shield(ShieldParameters { division, ..mesh.parameters() }))
            }
            MeshConfig::Boxes(mesh) => Some(Self::Boxes(BoxesParameters { division, ..mesh.parameters() })),
            MeshConfig::Sphere(mesh) => {
                let own = mesh.parameters();
                let refinement = own.refinement * parts as f64;
                Some(Self::Sphere(SphereParameters {
                    refinement,
                    growth: own.growth.powf(parts as f64),
                    ..own
                }))
            }
            MeshConfig::Block(_) | MeshConfig::File { .. } => None,
        }
    }

    /// Its tetrahedra; `None` where the generator refuses the parameters.
    pub(crate) fn tet_count(&self) -> Option<usize> {
        match self {
            Self::Shield(parameters) => parameters.tet_count(),
            Self::Boxes(parameters) => parameters.tet_count(),
            Self::Sphere(parameters) => parameters.tet_count(),
        }
        .ok()
    }

    /// The mesh, with the interfaces that the configuration names and its shell of open space.
    pub(crate) fn build(&self, config: &Config, source: &SourceMap) -> Result<Mesh, Error> {
        let mesh = match self {
            Self::Shield(parameters) => shield(parameters),
            Self::Boxes(parameters) => boxes(parameters),
            Self::Sphere(parameters) => sphere(parameters),
        }?;
        let measured = functionals(config).into_iter().filter(|(_, own)| own.is_over_cells());
        let is_one_of_elements = |name: &&str| mesh.topology().given_cells(name).is_none();
        let names: BTreeSet<&str> =
            measured.filter_map(|(_, own)| own.region.as_deref()).filter(is_one_of_elements).collect();
        let mesh =
            if names.is_empty() { mesh } else { with_cells_of(&build(config, source)?.mesh, &mesh, &names)? };
        open::with_shell(named_interfaces(mesh, config)?, config, source)
    }
}

/// The divided mesh with the cells that a coarser one has in regions of which every element is one: a sum over cells has the same
/// terms then. An element belongs to the one that its centroid is in; beside a round face, to the nearest.
fn with_cells_of(coarse: &Mesh, mesh: &Mesh, names: &BTreeSet<&str>) -> Result<Mesh, MeshError> {
    let mut topology = mesh.topology().as_ref().clone();
    for name in names {
        let own = coarse.topology().elements_of(coarse.topology().region(name)?);
        let places: Vec<Point> = own.iter().map(|&e| centroid(coarse.vertices(e))).collect();
        let nearest = |point: Point| {
            let apart = |i: &usize| norm(sub(places[*i], point));
            (0..own.len()).min_by(|a, b| apart(a).total_cmp(&apart(b))).unwrap_or_default()
        };
        let elements = topology.elements_of(topology.region(name)?);
        let middles: Vec<Point> = elements.iter().map(|&e| centroid(mesh.vertices(e))).collect();
        let mut cells = vec![Vec::new(); own.len()];
        for ((element, point), located) in elements.iter().zip(&middles).zip(locate(coarse, &middles)) {
            let place = located.and_then(|(e, _)| own.binary_search(&e).ok());
            cells[place.unwrap_or_else(|| nearest(*point))].push(*element);
        }
        cells.retain(|cell| !cell.is_empty());
        topology = topology.with_cells(name, cells);
    }
    Mesh::new(Arc::new(topology), mesh.points().to_vec())
}

/// The box around everything that moves and everything that objective and constraints take of the field.
fn device(config: &Config, problem: &Problem) -> Option<[Point; 2]> {
    let topology = problem.original().topology();
    let mut elements = problem.moving_elements().to_vec();
    let measured = functionals(config).into_iter().filter(|(_, own)| own.kind.is_of_field());
    let mut ends: Vec<Point> = Vec::new();
    for (_, own) in measured {
        let of_body = body_of(config, own).into_iter().flat_map(|body| &body.regions).map(String::as_str);
        for region in region_in_mesh(own).into_iter().chain(of_body) {
            elements.extend(topology.region(region).map(|id| topology.elements_of(id)).unwrap_or_default());
        }
        if let Some(set) = expansion_of(config, own) {
            ends.extend([-set.radius, set.radius].map(|reach| set.center.map(|c| c + reach)));
        }
    }
    let corners = elements.iter().flat_map(|&e| problem.original().vertices(e)).chain(ends);
    corners.fold(None, |around, x| {
        let [low, high] = around.unwrap_or([x, x]);
        Some([[0, 1, 2].map(|d| low[d].min(x[d])), [0, 1, 2].map(|d| high[d].max(x[d]))])
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use fluxmorph_geometry::ElementId;
    use fluxmorph_geometry::generate::BoxRegion;
    use fluxmorph_geometry::tet4::volume;

    use crate::build::{Mode, set_up};

    /// Of the quick shield nothing moves where it is observed.
    #[test]
    fn the_device_holds_the_bodies_and_expansions_that_are_asked_about() {
        let home = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("configs");
        let shipped = std::fs::read_to_string(home.join("shield_quick.toml")).expect("it is shipped");
        let observed = "kind = \"flux_density_squared\"\nregion = \"observation\"\nweighting = \"point\"\n";
        let lowest = |objective: &str| {
            let text = shipped.replace(observed, objective);
            let (config, source) = Config::from_str(&text, "test.toml").expect("a sound configuration");
            let problem = set_up(&config, &source, Mode::Optimisation).expect("a sound problem").problem;
            device(&config, &problem).expect("something moves")[0][2]
        };
        let of_region = lowest(observed);
        assert!(lowest("kind = \"loss\"\nregion = \"plate\"\n") > of_region);
        let body = "[[forces]]\nname = \"seen\"\nregions = [\"observation\"]\n";
        let force = "kind = \"force\"\nregion = \"seen\"\ndirection = [0, 0, 1]\n";
        assert_eq!(lowest(&format!("{force}{body}")), of_region);
        let ball = "[[multipoles]]\nname = \"ball\"\nshape = \"ball\"\ncenter = [0, 0, \"-200 mm\"]\naxis = \"z\"\n\
                    radius = \"30 mm\"\norder = 2\nmain = 0\n";
        let content = "kind = \"multipole_content\"\nregion = \"ball\"\nharmonics = [\"c1_0\"]\n";
        assert!((lowest(&format!("{content}{ball}")) + 0.23).abs() < 1e-12);
    }

    #[test]
    fn the_cells_of_a_divided_mesh_are_the_elements_that_were_divided() {
        let region = |name: &str, corners| BoxRegion {
            name: name.to_owned(),
            corners,
            size: [1.0; 3],
            skin: [f64::INFINITY; 3],
            cells: None,
        };
        let observed = [[0.0; 3], [2.0, 1.0, 1.0]];
        let parameters = |division| BoxesParameters {
            corners: [[-2.0; 3], [3.0; 3]],
            regions: vec![region("observed", observed)],
            sizes: Vec::new(),
            surfaces: Vec::new(),
            growth: 2.0,
            refinement: 1.0,
            division,
        };
        let coarse = boxes(&parameters(None)).expect("a box");
        let fine = boxes(&parameters(Some(Division { inside: observed, parts: 2 }))).expect("a finer box");
        let fine = with_cells_of(&coarse, &fine, &BTreeSet::from(["observed"])).expect("cells");
        let of =
            |mesh: &Mesh| mesh.topology().cells_of(mesh.topology().region("observed").expect("a region"));
        let volume_of =
            |mesh: &Mesh, cell: &[ElementId]| -> f64 { cell.iter().map(|&e| volume(mesh.vertices(e))).sum() };
        let (elements, cells) = (of(&coarse), of(&fine));
        assert_eq!(elements.len(), cells.len());
        for (element, cell) in elements.iter().zip(&cells) {
            assert_eq!(cell.len(), 8, "two parts along each axis");
            assert!((volume_of(&coarse, element) - volume_of(&fine, cell)).abs() < 1e-12);
        }
    }
}
