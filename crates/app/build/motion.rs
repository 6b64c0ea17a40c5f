//! A prescribed motion of a configuration: mesh, elastic body, and the path of the nodes that are moved.
//!
//! No field problem is set up: `[coils]`, `[boundaries]` and the rest are not looked at.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use fluxmorph_geometry::box_tree::BoxTree;
use fluxmorph_geometry::depth::nearest_on_triangle;
use fluxmorph_geometry::tet4::{Point, norm, sub};
use fluxmorph_geometry::{Mesh, NodeId, millimetres};
use fluxmorph_remesh::RemeshSetup;

use super::elastic_body::{Mover, common_axis, guidance, motion_law, remesh_setup, unused_keys};
use super::names::name_faults;
use super::{field, mesh, soundness};
use crate::config::{
    Config, DesignMotion, DesignWord, Diagnostic, Morphing, PrescribedMotion, SourceMap, Target,
};
use crate::error::Error;
use crate::run::morph::path::{NodeMotion, Path, Transform};

/// Half a turn, with what degrees are rounded by [rad].
const HALF_A_TURN: f64 = PI * (1.0 + 1e-6);

/// How far from a line, box or point of the configuration a node may lie, as a share of the mesh's diagonal:
/// coordinates in mesh files carry 6 digits or more, and no cell is a millionth of the mesh.
const NEAR: f64 = 1e-6;

/// A motion that can be computed.
#[derive(Debug)]
pub struct MotionSetup {
    /// The mesh, without regions that impedance surfaces replace.
    pub mesh: Mesh,
    /// The elastic body; its design nodes are those of the path.
    pub remesh: RemeshSetup,
    /// Where the design nodes go.
    pub path: Path,
    /// Warnings and notices, in the order found.
    pub warnings: Vec<String>,
}

/// Sets up the motion of `[morph]`.
///
/// # Errors
/// All faults of names and places at once; then whatever the mesh refuses.
pub fn set_up_motion(config: &Config, source: &SourceMap) -> Result<MotionSetup, Error> {
    build_motion(config, source).map_err(|error| super::locate_error::attribute_error(error, config, source))
}

fn build_motion(config: &Config, source: &SourceMap) -> Result<MotionSetup, Error> {
    let Morphing { morph, remesh } = config.morphing(source)?;
    let mesh::Built { mesh: full_mesh, notices: mut warnings, .. } = mesh::build(config, source)?;
    warnings.extend_from_slice(source.notices());
    source.check(name_faults(config, source, full_mesh.topology()))?;
    source.check(soundness::contact_faults(config, source, &full_mesh))?;
    warnings.extend(soundness::layer_warnings(config, &full_mesh));
    let (mesh, _) = field::without_replaced_regions(config, &full_mesh)?;

    let mut faults = Vec::new();
    let mut moved: BTreeMap<NodeId, NodeMotion> = BTreeMap::new();
    let mut transforms = Vec::new();
    for (i, motion) in morph.motion.iter().enumerate() {
        let path = format!("morph.motion[{i}]");
        if let Target::Design(design) = &motion.target {
            moved.extend(design_motion(config, source, &path, design, &full_mesh, &mesh)?);
            continue;
        }
        if let Some(angle) = motion.rotation.map(|own| own.angle).filter(|angle| angle.abs() > HALF_A_TURN) {
            let key = format!("{path}.rotation.angle");
            let message = format!("`{key}` is {:.1} degrees", angle.to_degrees());
            let expected = "at most half a turn: the shorter way round ends alike";
            faults.push(source.diagnostic(&key, message).expected(expected));
        }
        match nodes_of(source, &path, &motion.target, &mesh) {
            Ok(nodes) => {
                let transform = transforms.len();
                transforms.push(transform_of(motion));
                moved.extend(
                    nodes
                        .into_iter()
                        .map(|node| (node, NodeMotion::Transformed { from: mesh.point(node), transform })),
                );
            }
            Err(fault) => faults.push(*fault),
        }
    }
    if morph.motion.is_empty() {
        let fault = source.diagnostic("morph.motion", "no motion is prescribed");
        faults.push(fault.expected("at least one table [[morph.motion]]"));
    }
    source.check(faults)?;
    let (nodes, motions): (Vec<_>, Vec<_>) = moved.into_iter().unzip();
    let guidance = guidance(source, config.design.as_ref(), remesh)?;
    let path = Path::new(nodes, motions, transforms);
    // What turns leaves its axis on the way, where it does not at the end.
    let on_the_way = [path.at(0.37), path.at(1.0)].concat();
    let law = motion_law(source, remesh, common_axis(&on_the_way), Mover::Morph)?;
    warnings.extend(unused_keys(source, remesh, law));
    let setup = remesh_setup(source, remesh, &mesh, path.nodes(), (law, guidance), &mut warnings)?;
    if path.at(1.0).iter().all(|u| *u == [0.0; 3]) {
        warnings.push(
            "the prescribed motion moves no node: every displacement is zero, every factor 1 and every angle 0".to_owned(),
        );
    }
    Ok(MotionSetup { mesh, remesh: setup, path, warnings })
}

fn transform_of(motion: &PrescribedMotion) -> Transform {
    let none = Transform::NONE;
    Transform {
        scale: motion.scale.map_or(none.scale, |scale| (scale.center, scale.factor)),
        rotation: motion.rotation.map_or(none.rotation, |rotation| {
            let axis = rotation.axis.vector();
            let length = norm(axis);
            (rotation.center, axis.map(|c| c / length), rotation.angle)
        }),
        displacement: motion.displacement.unwrap_or(none.displacement),
    }
}

/// The nodes of a surface, line, list or box; a fault where there is none.
fn nodes_of(
    source: &SourceMap,
    path: &str,
    target: &Target,
    mesh: &Mesh,
) -> Result<Vec<NodeId>, Box<Diagnostic>> {
    let topology = mesh.topology();
    let [lower, upper] = mesh.bounding_box();
    let near = NEAR * norm(sub(upper, lower));
    let chosen = |inside: &dyn Fn(Point) -> bool| -> Vec<NodeId> {
        topology.nodes().filter(|&node| inside(mesh.point(node))).collect()
    };
    let (key, nodes) = match target {
        Target::Surface(names) => {
            let triangles = names.iter().filter_map(|name| topology.surface(name).ok()).flatten();
            ("surface", triangles.flatten().copied().collect())
        }
        Target::Line([start, end]) => {
            ("line", chosen(&|point| nearest_on_triangle(point, &[*start, *end, *end]).1 <= near))
        }
        Target::Box([low, high]) => {
            let inside = |p: Point| (0..3).all(|d| low[d] - near <= p[d] && p[d] <= high[d] + near);
            ("box", chosen(&inside))
        }
        Target::Nodes(points) => ("nodes", nodes_at(source, path, points, mesh, near)?),
        Target::Design(_) => ("design", Vec::new()),
    };
    if nodes.is_empty() {
        let fault =
            source.diagnostic(&format!("{path}.{key}"), format!("`{path}.{key}` holds no node of the mesh"));
        let range = format!(
            "places inside the mesh, which goes from {} to {}",
            millimetres(lower),
            millimetres(upper)
        );
        return Err(Box::new(fault.expected(range)));
    }
    Ok(nodes)
}

/// The nodes nearest to the points of a list; a fault where one is not `near`.
fn nodes_at(
    source: &SourceMap,
    path: &str,
    points: &[Point],
    mesh: &Mesh,
    near: f64,
) -> Result<Vec<NodeId>, Box<Diagnostic>> {
    let tree = BoxTree::of_points(mesh.points());
    let node_at = |(i, &point): (usize, &Point)| {
        let nearest = tree.nearest(point).map(|(i, square)| (NodeId::new(i), square.sqrt()));
        if let Some((node, _)) = nearest.filter(|&(_, distance)| distance <= near) {
            return Ok(node);
        }
        let place = nearest.map_or_else(|| "nowhere".to_owned(), |(n, _)| millimetres(mesh.point(n)));
        let message = format!("there is no node at {}", millimetres(point));
        let fault = source.diagnostic(&format!("{path}.nodes[{i}]"), message);
        Err(Box::new(fault.expected(format!("a node of the mesh; the nearest is at {place}"))))
    };
    points.iter().enumerate().map(node_at).collect()
}

/// The nodes of the design surface and where a design moves them.
fn design_motion(
    config: &Config,
    source: &SourceMap,
    path: &str,
    motion: &DesignMotion,
    full_mesh: &Mesh,
    mesh: &Mesh,
) -> Result<Vec<(NodeId, NodeMotion)>, Error> {
    let path = format!("{path}.design");
    let refused = |fault: Diagnostic| -> Error { source.error(vec![fault]).into() };
    let Some(design) = &config.design else {
        return Err(refused(
            source
                .diagnostic(&path, "there is no [design], so a design has no meaning")
                .help("add a table [design]"),
        ));
    };
    let full_surface = super::design::surface(config, source, design, full_mesh)?;
    let surface = super::design::on_remaining(source, &full_surface, full_mesh, mesh)?;
    let count = surface.variable_count();
    let values = match motion {
        DesignMotion::Word(DesignWord::Lower) => vec![design.lower; count],
        DesignMotion::Word(DesignWord::Upper) => vec![design.upper; count],
        DesignMotion::Word(DesignWord::Alternating) => {
            // On a full control grid the parity of row and column, else that of the number.
            let columns = design.grid.filter(|[n, m]| n * m == count).map_or(1, |[_, m]| m);
            let odd = |k: usize| if columns == 1 { k % 2 } else { (k / columns + k % columns) % 2 };
            (0..count).map(|k| if odd(k) == 0 { design.lower } else { design.upper }).collect()
        }
        DesignMotion::Values(values) => values.clone(),
    };
    if values.len() != count {
        let message = format!("`{path}` has {} lengths", values.len());
        return Err(refused(
            source.diagnostic(&path, message).expected(format!("one for each of {count} design variables")),
        ));
    }
    let displacement = surface.displacement(&values).into_iter().map(NodeMotion::Straight);
    Ok(surface.nodes().iter().copied().zip(displacement).collect())
}
