//! Whether coils, magnets and what is measured can be meant as they stand in the mesh: sizes, places, units, materials, images.
//!
//! What cannot be meant is refused at its key; what is rarely meant is a warning.

use std::collections::HashSet;
use std::f64::consts::TAU;
use std::ops::RangeInclusive;

use fluxmorph_geometry::soundness::OpenPatch;
use fluxmorph_geometry::tet4::{Point, dot, norm};
use fluxmorph_geometry::topology::face_key;
use fluxmorph_geometry::{ElementId, Mesh, Millimetres, NodeId, RegionId, Topology, millimetres};
use fluxmorph_solver::coil::{self, Racetrack};

use super::entries::{is_magnet, material};
use super::held::sides;
use super::references::functionals;
use super::soundness::{faces_of, faces_without_condition, normal, size};
use super::thin_windings::{self, section};
use crate::config::{
    Coil, CoilPath, CoilShape, Compared, ConductorWord, Config, Diagnostic, Functional, LoadCase, MeshConfig,
    ObjectiveKind, SourceMap,
};

/// Least width and height of a winding, relative to the size of the mesh: no element is that small, and the field of a thinner
/// one is the same.
const THINNEST: f64 = 1e-6;

/// Shares of the mesh's size below and above which a coil looks like one in another unit.
const ALIKE: [f64; 2] = [2e-2, 2.0];

/// Relative permeability below which none is of a usual material: bismuth has 0.9998.
const LEAST_PERMEABILITY: f64 = 0.9;

/// Conductivities [S/m] that are a metal's in MS/m: brass has 15, copper 58. Salt water has 5, ferrites less, carbon 10⁴.
const OF_METALS_IN_MS: RangeInclusive<f64> = 10.0..=65.0;

/// Relative permeability that no material has: annealed permalloy has 10⁶.
pub(super) const MOST_PERMEABILITY: f64 = 2e6;

/// Conductivity that no metal has at room temperature [S/m]: silver has 6.3e7.
const MOST_CONDUCTIVITY: f64 = 7e7;

/// Densities [kg/m³] that are a solid's in g/cm³: ferrites have 4.8, tungsten 19.3.
const OF_SOLIDS_IN_G_PER_CM3: RangeInclusive<f64> = 1.0..=22.6;

/// Density that no material has [kg/m³]: osmium has 22 590.
const MOST_DENSITY: f64 = 2.3e4;

/// Remanence that no magnet has [T]: neodymium has 1.5.
const MOST_REMANENCE: f64 = 2.0;

/// Places along each direction at which two windings are looked at: as many as miss no overlap of a thirtieth of their common box.
const GRID: usize = 30;

/// Speed of light [m/s].
const SPEED_OF_LIGHT: f64 = 299_792_458.0;

/// Part of a wave's length that a quasi-static field may take: a tenth of it changes phases by 36°.
const LARGEST_PART_OF_A_WAVE: f64 = 0.1;

/// Part of a unit vector along a plane, or across it, that is more than rounding.
pub(super) const INCLINED: f64 = 1e-3;

/// Coils of the configuration that are no source of a field in this mesh, or no physical one.
pub(super) fn coil_faults(
    config: &Config,
    source: &SourceMap,
    mesh: &Mesh,
    coils: &[coil::Coil],
) -> Vec<Diagnostic> {
    let size = size(mesh);
    let mut faults = Vec::new();
    for (i, (written, built)) in config.coils.iter().zip(coils).enumerate() {
        let coil::CoilShape::Racetrack(winding) = &built.shape else {
            faults.extend(strands_in_iron(config, source, i));
            continue;
        };
        if let Some((key, length)) =
            section(written).into_iter().find(|(_, length)| *length < THINNEST * size)
        {
            let message =
                format!("`coils[{i}].{key}` is {length:e} m, below any element of a mesh of {size:.4} m");
            let expected = format!("at least {:.1e} m, a millionth of the mesh", THINNEST * size);
            faults.push(source.diagnostic(&format!("coils[{i}].{key}"), message).expected(expected));
        } else if let Some((region, place)) = matter_in(config, mesh, winding) {
            let name = &mesh.topology().region_names()[region.index()];
            let message = format!(
                "the current of the coil `{}` flows inside `{name}`, at {}, which is iron, a magnet or a conductor",
                built.name,
                millimetres(place)
            );
            faults.push(
                source
                    .diagnostic(&format!("coils[{i}].center"), message)
                    .expected("a winding in air, or in what is meshed and has no permeability, remanence or conductivity")
                    .help(
                        "move the coil or the region; the strands of a winding are no material of [regions]",
                    ),
            );
        }
    }
    faults
}

/// Strands in a region of iron or of a magnet.
fn strands_in_iron(config: &Config, source: &SourceMap, i: usize) -> Option<Diagnostic> {
    let coil = &config.coils[i];
    let CoilShape::Region(own) = &coil.shape else { return None };
    let is_iron = material(config, &own.region).relative_permeability != 1.0;
    ((is_iron || is_magnet(config, &own.region)) && own.conductor == ConductorWord::Stranded).then(|| {
        let message = format!(
            "the strands of the coil `{}` fill `{}`, whose material has a permeability or a remanence: its flux would be that of \
             iron or of a magnet",
            coil.name, own.region
        );
        source
            .diagnostic(&format!("coils[{i}].region"), message)
            .expected("a region without a material of iron or of a magnet")
            .help("take the material or the remanence off the region; conductor = \"solid\" is a bar of iron")
    })
}

/// What is rarely meant; `coils` are those of the configuration, and the outer faces without a condition lie in `open_patches`.
pub(super) fn warnings(
    config: &Config,
    mesh: &Mesh,
    coils: &[coil::Coil],
    open_patches: &[OpenPatch],
) -> Vec<String> {
    let mut warnings: Vec<String> = Vec::new();
    warnings.extend(wave_warning(config, mesh));
    warnings.extend(overlap_warnings(config, mesh, coils));
    warnings.extend((0..config.coils.len()).filter_map(|i| twin_warning(config, i)));
    if config.boundaries.is_empty() && !open_patches.is_empty() {
        warnings.push(
            "no surface has a condition in [boundaries]: at all of them the field is left normal to the surface, as in \
             flux_normal"
                .to_owned(),
        );
    }
    warnings.extend(material_warnings(config));
    let free = if open_patches.is_empty() { HashSet::new() } else { faces_without_condition(config, mesh) };
    warnings.extend(config.regions.iter().flat_map(|(name, own)| {
        own.remanence.map(|own| magnet_warnings(config, (mesh, &free), (name, own))).unwrap_or_default()
    }));
    warnings.extend(config.coils.iter().filter_map(|coil| image_warning(config, mesh.topology(), coil)));
    warnings.extend(
        windings(coils)
            .filter_map(|(i, winding)| thin_windings::warning(config, mesh, &config.coils[i], winding)),
    );
    warnings.extend(super::forces::warnings(config, mesh, coils));
    warnings.extend(phase_warnings(config));
    warnings.extend(homogeneity_warnings(config, (mesh, &free)));
    warnings.extend(unit_hint(config, mesh));
    warnings
}

/// What to say of materials that do not exist.
fn material_warnings(config: &Config) -> Vec<String> {
    let mut warnings = Vec::new();
    for (name, own) in &config.materials {
        let permeability = own.relative_permeability;
        if permeability < LEAST_PERMEABILITY {
            warnings.push(format!(
                "the material `{name}` has the relative permeability {permeability}, which keeps flux out as no material but a \
                 superconductor does: of iron it is hundreds, and μr μ0 is not meant here"
            ));
        }
        if permeability > MOST_PERMEABILITY {
            warnings.push(format!(
                "the material `{name}` has the relative permeability {permeability:e}, more than any: the best annealed alloys reach a million"
            ));
        }
        let conductivity = own.conductivity;
        if OF_METALS_IN_MS.contains(&conductivity) {
            warnings.push(format!(
                "the material `{name}` has a conductivity of {conductivity} S/m, a millionth of a metal's: \"{conductivity} MS/m\", where \
                 that is meant"
            ));
        } else if conductivity > MOST_CONDUCTIVITY {
            warnings.push(format!(
                "the material `{name}` has a conductivity of {conductivity:e} S/m, more than any metal at room temperature: silver has \
                 6.3e7"
            ));
        }
        let Some(density) = own.density else { continue };
        if OF_SOLIDS_IN_G_PER_CM3.contains(&density) {
            warnings.push(format!(
                "the material `{name}` has a density of {density} kg/m³, a thousandth of a solid's: \"{density} g/cm3\", where that is \
                 meant"
            ));
        } else if density > MOST_DENSITY {
            warnings.push(format!(
                "the material `{name}` has a density of {density:e} kg/m³, more than any: osmium has 22 590"
            ));
        }
    }
    warnings
}

/// What to say of a frequency at which the field would be a wave: neglected displacement currents are no longer small.
fn wave_warning(config: &Config, mesh: &Mesh) -> Option<String> {
    let frequency = config.frequencies().into_iter().fold(0.0, f64::max);
    let (length, size) = (SPEED_OF_LIGHT / frequency, size(mesh));
    (size > LARGEST_PART_OF_A_WAVE * length).then(|| {
        format!(
            "at {frequency:e} Hz a wave in air is {:.3} m long, and the mesh is {:.3} m from corner to corner: \
             displacement currents, which are left out, are no longer small there",
            Millimetres(1e-3 * length),
            Millimetres(1e-3 * size)
        )
    })
}

/// What to say of a coil whose current flows where that of an earlier one does, at the same time.
fn twin_warning(config: &Config, i: usize) -> Option<String> {
    let coil = &config.coils[i];
    let is_fed = |case: &LoadCase<'_>, coil: &Coil| {
        let feed = case.feed(coil);
        feed.by_voltage || feed.amplitude != 0.0
    };
    let flows_beside =
        |own: &&Coil| config.load_cases().iter().any(|case| is_fed(case, own) && is_fed(case, coil));
    let earlier = || config.coils[..i].iter().filter(flows_beside);
    if let Some(twin) = earlier().find(|own| own.shape == coil.shape) {
        return Some(format!(
            "the coils `{}` and `{}` are the same winding at the same place: their ampere-turns add up",
            twin.name, coil.name
        ));
    }
    let (twin, region) = earlier().find_map(|own| Some((own, common_region(own, coil)?)))?;
    Some(format!(
        "the currents of the coils `{}` and `{}` fill the same region `{region}`: they add up, and cancel where they are opposite; of \
         two conductors each is a region of its own",
        twin.name, coil.name
    ))
}

/// The region that the currents of two coils fill.
fn common_region<'a>(first: &Coil, second: &'a Coil) -> Option<&'a str> {
    match (&first.shape, &second.shape) {
        (CoilShape::Region(first), CoilShape::Region(second)) if first.region == second.region => {
            Some(&second.region)
        }
        _ => None,
    }
}

/// What to say of windings that take the same place, one of them analytic.
fn overlap_warnings(config: &Config, mesh: &Mesh, coils: &[coil::Coil]) -> Vec<String> {
    let all: Vec<(usize, &Racetrack)> = windings(coils).collect();
    let text = |[first, second]: [usize; 2], place: Point| {
        format!(
            "the windings of the coils `{}` and `{}` overlap, at {}: two wires cannot be in one place",
            config.coils[first].name,
            config.coils[second].name,
            millimetres(place)
        )
    };
    let in_region = |(i, winding): &(usize, &Racetrack)| {
        let of_regions = config.coils.iter().enumerate().filter_map(|(j, coil)| match &coil.shape {
            CoilShape::Region(own) => Some((j, mesh.topology().region(&own.region).ok()?)),
            _ => None,
        });
        let place = |region| place_of_current(mesh, winding, mesh.topology().elements_of(region));
        let met = of_regions.filter_map(|(j, region)| Some(text([*i, j], place(region)?.1)));
        met.collect::<Vec<String>>()
    };
    let pairs =
        all.iter().enumerate().flat_map(|(k, first)| all[k + 1..].iter().map(move |second| (first, second)));
    let warning = |((i, first), (j, second)): (&(usize, &Racetrack), &(usize, &Racetrack))| {
        let [first_coil, second_coil] = [*i, *j].map(|index| &config.coils[index]);
        // The same winding twice is said elsewhere.
        let is_other = first_coil.shape != second_coil.shape;
        let place = common_place(first, second).filter(|_| is_other)?;
        Some(text([*i, *j], place))
    };
    pairs.filter_map(warning).chain(all.iter().flat_map(in_region)).collect()
}

/// A place at which the current of both windings flows, of a grid over what their boxes have in common.
fn common_place(first: &Racetrack, second: &Racetrack) -> Option<Point> {
    let [a, b] = [first, second].map(Racetrack::bounding_box);
    let low: Point = std::array::from_fn(|d| a[0][d].max(b[0][d]));
    let high: Point = std::array::from_fn(|d| a[1][d].min(b[1][d]));
    if (0..3).any(|d| low[d] >= high[d]) {
        return None;
    }
    let at = |k: [usize; 3]| -> Point {
        std::array::from_fn(|d| low[d] + (high[d] - low[d]) * (k[d] as f64 + 0.5) / GRID as f64)
    };
    let mut all = (0..GRID.pow(3)).map(|k| at([k % GRID, k / GRID % GRID, k / GRID.pow(2)]));
    all.find(|x| flows(first, x) && flows(second, x))
}

/// The analytic windings, by the numbers of their coils.
pub(super) fn windings(coils: &[coil::Coil]) -> impl Iterator<Item = (usize, &Racetrack)> {
    coils.iter().enumerate().filter_map(|(i, coil)| match &coil.shape {
        coil::CoilShape::Racetrack(winding) => Some((i, winding)),
        _ => None,
    })
}

/// Whether a winding has current at a place.
fn flows(winding: &Racetrack, x: &Point) -> bool {
    norm(winding.current_density(*x)) > 0.0
}

/// Where the current of a winding flows in some elements.
pub(super) fn place_of_current(
    mesh: &Mesh,
    winding: &Racetrack,
    elements: impl IntoIterator<Item = ElementId>,
) -> Option<(ElementId, Point)> {
    elements.into_iter().find_map(|e| winding.wound_place(mesh.vertices(e)).map(|place| (e, place)))
}

/// What to say of a coil whose current runs along a wall that no flux passes, rarely meant: its mirror image is the opposite one.
fn image_warning(config: &Config, topology: &Topology, coil: &Coil) -> Option<String> {
    let CoilShape::Region(own) = &coil.shape else { return None };
    let crossed = match &own.path {
        CoilPath::Terminals { terminals } => faces_of(topology, terminals.iter().map(String::as_str)),
        CoilPath::Closed { .. } => HashSet::new(),
    };
    let outer = topology.outer_faces(topology.region(&own.region).ok()?);
    let mut along = outer.into_iter().map(face_key).collect::<HashSet<_>>();
    along.retain(|face| !crossed.contains(face));
    let walls = &config.boundaries.flux_parallel;
    let wall = walls.iter().find(|wall| !faces_of(topology, [wall.as_str()]).is_disjoint(&along))?;
    Some(format!(
        "the current of the coil `{}` runs along `{wall}`, a surface of flux_parallel, which mirrors it reversed; a plane of symmetry \
         along the current is flux_normal",
        coil.name
    ))
}

/// What to say of a magnet that is cut by a surface which mirrors a part of its remanence reversed, or that no magnet has.
fn magnet_warnings(
    config: &Config,
    (mesh, free): (&Mesh, &HashSet<[NodeId; 3]>),
    (name, remanence): (&str, Point),
) -> Vec<String> {
    let (topology, size) = (mesh.topology(), norm(remanence));
    let mut warnings = Vec::new();
    if size > MOST_REMANENCE {
        warnings.push(format!(
            "the remanence of `{name}` is {size} T, more than any magnet has: neodymium has 1.5 T"
        ));
    }
    let Ok(region) = topology.region(name) else { return warnings };
    warnings.extend(turning_surfaces(config, (mesh, free), region, remanence).map(|Turning { surface, kind, part }| {
        format!(
            "the magnet `{name}` is cut by {surface}, {kind}, which mirrors the part of its remanence {part} the surface reversed"
        )
    }));
    warnings
}

/// A surface at which the images of a vector are others.
struct Turning {
    /// Its name in marks, or what it is.
    surface: String,
    /// Its condition.
    kind: &'static str,
    /// Which part of the vector is reversed.
    part: &'static str,
}

/// The first surface of either condition, and of the faces that are free of one, on which a region ends, and which mirrors a part of a
/// vector there reversed, as it does of B.
fn turning_surfaces(
    config: &Config,
    (mesh, free): (&Mesh, &HashSet<[NodeId; 3]>),
    region: RegionId,
    vector: Point,
) -> impl Iterator<Item = Turning> {
    let topology = mesh.topology();
    let outer: HashSet<_> = topology.outer_faces(region).into_iter().map(face_key).collect();
    let boundaries = &config.boundaries;
    let across: fn(f64) -> bool = |share| share > INCLINED;
    let along: fn(f64) -> bool = |share| beside(share) > INCLINED;
    let turns = |faces: &HashSet<[NodeId; 3]>, is_reversed: fn(f64) -> bool| {
        let mut own = faces.intersection(&outer);
        own.any(|face| is_reversed(dot(normal(mesh, *face), vector).abs() / norm(vector)))
    };
    let named = |surfaces: &[String], is_reversed, kind, part| {
        let found =
            surfaces.iter().find(|surface| turns(&faces_of(topology, [surface.as_str()]), is_reversed));
        found.map(|surface| Turning { surface: format!("`{surface}`"), kind, part })
    };
    let free = turns(free, along).then(|| Turning {
        surface: "an outer side without condition".to_owned(),
        kind: "at which the field is left normal as in flux_normal",
        part: "along",
    });
    let parallel = named(&boundaries.flux_parallel, across, "a surface of flux_parallel", "across");
    let with_normal = named(&boundaries.flux_normal, along, "a surface of flux_normal", "along");
    [parallel, with_normal, free].into_iter().flatten()
}

/// What a unit vector with this part across a surface has along it.
pub(super) fn beside(across: f64) -> f64 {
    (1.0 - across * across).max(0.0).sqrt()
}

/// What to say of the homogeneity of a component that is another one in the images of its region, and of the vector behind a side at
/// which no image is counted: the mean is not the device's.
fn homogeneity_warnings(config: &Config, (mesh, free): (&Mesh, &HashSet<[NodeId; 3]>)) -> Vec<String> {
    let of = |(path, own): (String, &Functional)| {
        let is_homogeneity = own.kind == ObjectiveKind::Homogeneity;
        let name = own.region.as_ref().filter(|_| is_homogeneity)?;
        let region = mesh.topology().region(name).ok()?;
        let is_of_vectors = own.compare.map_or(own.direction.is_none(), |own| own == Compared::Vector);
        if is_of_vectors {
            let outer: HashSet<_> = mesh.topology().outer_faces(region).into_iter().map(face_key).collect();
            let is_free = |face| outer.contains(&face_key(face)) && free.contains(&face_key(face));
            return (!sides(mesh, is_free).is_empty()).then(|| {
                format!(
                    "{path}: `{name}` ends at an outer side without condition, and what is computed is the deviation of the meshed part \
                     from its own mean: images are counted behind surfaces of [boundaries] alone; name that side in flux_normal, with \
                     which the field is the same"
                )
            });
        }
        let is_component = own.compare.is_none_or(|compared| compared == Compared::Component);
        let direction = own.direction.filter(|_| is_component)?;
        let Turning { surface, .. } = turning_surfaces(config, (mesh, free), region, direction).next()?;
        Some(format!(
            "{path}: behind {surface} the images of `{name}` have another component along this direction, and what is computed is the \
             deviation of the meshed part from its own mean, which is not that of the whole device; take a direction that the plane \
             keeps, or mesh all of `{name}`"
        ))
    };
    functionals(config).into_iter().filter_map(of).collect()
}

/// What to say of phases of more than a turn: degrees without their unit.
fn phase_warnings(config: &Config) -> Vec<String> {
    let own = config.coils.iter().enumerate().map(|(i, coil)| (format!("coils[{i}].phase"), coil.phase));
    let of_loads = config.loads.iter().enumerate().flat_map(|(i, load)| {
        load.phase.iter().map(move |(coil, phase)| (format!("loads[{i}].phase.{coil}"), *phase))
    });
    let turned = own.chain(of_loads).filter(|(_, phase)| phase.abs() > TAU);
    let text = |(path, phase): (String, f64)| {
        format!(
            "{path} is {:.1} turns: if degrees are meant, they are written \"90 deg\"; a number without a unit is in radians",
            phase / TAU
        )
    };
    turned.map(text).collect()
}

/// What to say where a coil and the mesh are of such different sizes that one of their units is probably wrong.
pub(super) fn unit_hint(config: &Config, mesh: &Mesh) -> Option<String> {
    let size = size(mesh);
    let unlike = |width: &f64| *width < ALIKE[0] * size || *width > ALIKE[1] * size;
    let of = |coil: &Coil| {
        let width = half_extent(coil).map(|[a, b, _]| 2.0 * a.max(b)).filter(unlike)?;
        Some((coil.name.clone(), width))
    };
    let (coil, width) = config.coils.iter().find_map(of)?;
    let unit = match &config.mesh {
        MeshConfig::File { .. } => "mesh.unit and the units of the coil",
        _ => "the units of the mesh and of the coil",
    };
    Some(format!("the coil `{coil}` is {width:.4} m wide and the mesh {size:.4} m: check {unit}"))
}

/// Half sizes of the box around an analytic coil, across its axis and along it [m].
fn half_extent(coil: &Coil) -> Option<[f64; 3]> {
    let of = |[a, b]: [f64; 2], width: f64, height: f64| Some([a + width, b + width, 0.5 * height]);
    match &coil.shape {
        CoilShape::Racetrack(c) => of(c.half_window, c.width, c.height),
        CoilShape::Circular(c) => of([c.radius; 2], c.width, c.height),
        CoilShape::Region(_) => None,
    }
}

/// A region of iron, of a magnet or of a conductor that the current of a coil flows in, and where.
fn matter_in(config: &Config, mesh: &Mesh, winding: &Racetrack) -> Option<(RegionId, Point)> {
    let topology = mesh.topology();
    let changes = config.alternates();
    let is_matter = |name: &String| {
        let own = material(config, name);
        let conducts = changes && own.conductivity > 0.0;
        own.relative_permeability != 1.0 || is_magnet(config, name) || !config.is_meshed(name) || conducts
    };
    let matter: Vec<bool> = topology.region_names().iter().map(is_matter).collect();
    let region = |e: ElementId| topology.region_of()[e.index()];
    let (e, place) =
        place_of_current(mesh, winding, topology.elements().filter(|e| matter[region(*e).index()]))?;
    Some((region(e), place))
}
