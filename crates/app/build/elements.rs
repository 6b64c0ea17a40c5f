//! Whether family and order of the elements can represent the field of these materials in this mesh.
//!
//! What would be off by more than a tenth is refused, what may be is a warning; both name the key that cures it. The limits are
//! measured (docs/verification.md, 2.8).

use fluxmorph_geometry::{Mesh, Millimetres, Readable};
use fluxmorph_solver::audit::NodalErrors;

use super::entries::{has_curve, material};
use super::field;
use super::skin::Audited;
use crate::config::{Config, Diagnostic, ElementOrder, Elements, RegionModel, SourceMap};

/// Relative permeability above which edge elements of first order are coarse beside iron: 15 % in the energy norm at 1e5, 0.2 %
/// in the gap of a C-core of 2000.
const EDGE_DOUBTFUL: f64 = 1e3;

/// Estimated error of the field beside a conductor above which nodal elements are doubtful, and refused.
const FIELD: [f64; 2] = [0.03, 0.1];

/// Estimated error of its losses. It is an upper one: at 1 they were off by 5 to 100 %.
const LOSSES: [f64; 2] = [0.1, 1.0];

/// Permeability that carries flux, of iron that currents fill, above which nodal elements of first and of second order are doubtful
/// in its losses. First order: free plates and blocks of 1.9 were off by 12 to 43 %, what has less by at most 4 %; second: a free
/// plate of 1.9 by 5 %, one of 19 by 15 %.
const FILLED_IRON: [f64; 2] = [1.0, 10.0];

/// What the elements cannot represent: a field that would be off by more than a tenth, or none at all.
pub(super) fn faults(
    config: &Config,
    source: &SourceMap,
    mesh: &Mesh,
    audits: &[Audited],
) -> Vec<Diagnostic> {
    let weak = meshed(audits).filter(|audited| {
        config.analysis.elements == Elements::Edge && audited.audit.is_too_weak_for_edges()
    });
    let weak = weak.map(|Audited { audit, .. }| {
        let message = format!(
            "eddy currents in `{}` are too weak for edge elements: an element takes {:.1e} of the skin depth of {:.3} m",
            audit.region,
            1.0 / audit.median_elements_per_skin_depth,
            audit.skin_depth
        );
        source.diagnostic(&format!("regions.{}.material", audit.region), message).expected(
            "a material without conductivity, for these currents change no field, or analysis.elements = \"nodal\" for \
             their loss",
        )
    });
    let iron = nodal_iron(config, mesh, audits).filter(|(iron, limits)| iron.carrying > limits.refused);
    let iron = iron.map(|(iron, limits)| {
        let message = format!(
            "nodal elements of order {} lose more than a tenth of the flux beside iron of the relative permeability {} (`{}`{}): {}",
            u8::from(config.analysis.order),
            iron.permeability(),
            iron.region,
            iron.shielding(),
            limits.wrong
        );
        nodal_fault(source, message)
    });
    let conductors = nodal_conductors(config, audits)
        .filter(|(_, errors)| errors.field > FIELD[1] || (!errors.is_filled && errors.losses > LOSSES[1]));
    let conductors =
        conductors.map(|(audited, errors)| nodal_fault(source, coarse(config, audited, &errors)));
    weak.chain(iron).chain(conductors).collect()
}

/// What is doubtful beside iron and conductors.
pub(super) fn warnings(config: &Config, mesh: &Mesh, audits: &[Audited]) -> Vec<String> {
    let conductors = nodal_conductors(config, audits)
        .filter(|(_, errors)| errors.field > FIELD[0] || errors.losses > LOSSES[0])
        .map(|(audited, errors)| format!("{}. Set {CURE}", coarse(config, audited, &errors)));
    beside_iron(config, mesh, audits)
        .into_iter()
        .chain(filled_iron(config, audits))
        .chain(conductors)
        .collect()
}

/// Iron that is no thicker than its skin, whose losses go with the flux that it draws in, of which nodal elements lose a part.
fn filled_iron<'a>(config: &'a Config, audits: &'a [Audited]) -> impl Iterator<Item = String> + 'a {
    let order = u8::from(config.analysis.order);
    let most = FILLED_IRON[usize::from(order) - 1];
    let of = nodal_conductors(config, audits).filter(move |(Audited { audit, model, .. }, errors)| {
        let drawn_in = audit.carrying_permeability() * (1.0 - 1.0 / audit.relative_permeability);
        *model == RegionModel::Volume && errors.is_filled && drawn_in > most
    });
    of.map(move |(Audited { audit, .. }, _)| {
        format!(
            "iron in `{}`, of the relative permeability {} and {:.2} skin depths thick, draws in flux of which nodal elements of \
             order {order} lose a part: its losses in a field along it, and weak fields beside it, may be wrong by a tenth to \
             factors. Set {CURE}",
            audit.region,
            Readable(audit.relative_permeability),
            audit.thickness_in_skin_depths
        )
    })
}

/// What nodal elements lack.
const CURE: &str = "analysis.elements = \"edge\"";

fn nodal_fault(source: &SourceMap, message: String) -> Diagnostic {
    source.diagnostic("analysis.elements", message).expected("elements = \"edge\" in [analysis]")
}

/// Conductors in which `A` and `ψ` are unknown.
fn meshed(audits: &[Audited]) -> impl Iterator<Item = &Audited> {
    audits.iter().filter(|audited| audited.model == RegionModel::Volume)
}

/// Conductors of nodal elements, and what these make of them.
fn nodal_conductors<'a>(
    config: &Config,
    audits: &'a [Audited],
) -> impl Iterator<Item = (&'a Audited, NodalErrors)> {
    let is_nodal = config.analysis.elements == Elements::Nodal;
    let order = field::order(config);
    let of = move |audited: &'a Audited| {
        let errors = match audited.model {
            RegionModel::Volume => audited.audit.nodal_errors(order),
            RegionModel::Impedance => audited.audit.nodal_surface_errors(order),
            RegionModel::Perfect => return None,
        };
        Some((audited, errors))
    };
    audits.iter().filter(move |_| is_nodal).filter_map(of)
}

/// What nodal elements make of a conductor.
fn coarse(config: &Config, Audited { audit, model, .. }: &Audited, errors: &NodalErrors) -> String {
    let [place, beside] = match model {
        RegionModel::Impedance => ["and on its impedance surface", ", though the field is not"],
        RegionModel::Volume | RegionModel::Perfect => ["in which", ""],
    };
    let wrong = if errors.field > FIELD[0] {
        "the field beside it and its losses"
    } else if errors.is_filled {
        "its losses in a field along it"
    } else {
        "its losses"
    };
    format!(
        "the cells of `{}` are {:.3} mm wide on average at a skin depth of {:.3} mm, {place} nodal elements of order {} cannot \
         make A + grad(psi) zero: {wrong} may be wrong by a tenth to factors{beside}",
        audit.region,
        Millimetres(audit.edge_length),
        Millimetres(audit.skin_depth),
        u8::from(config.analysis.order),
    )
}

/// Relative permeabilities above which nodal elements of an order are doubtful, and off by more than a tenth, and what is
/// wrong then.
struct Limits {
    doubtful: f64,
    refused: f64,
    wrong: &'static str,
}

/// Iron, by what of its relative permeability carries flux.
struct Iron<'a> {
    region: &'a str,
    relative_permeability: f64,
    /// Less than all of it where eddy currents keep the flux out.
    carrying: f64,
    /// Whether the permeability is what stands for a curve.
    is_of_curve: bool,
}

impl Iron<'_> {
    /// What there is to say of the permeability, for which that of a curve has no one number.
    fn permeability(&self) -> String {
        let taken = if self.is_of_curve { ", taken for its curve" } else { "" };
        format!("{}{taken}", Readable(self.relative_permeability))
    }

    /// What there is to say beside the permeability.
    fn shielding(&self) -> String {
        if self.carrying < self.relative_permeability {
            format!(
                ", {:.1} of it along the region, for eddy currents keep the flux in the skin",
                self.carrying
            )
        } else {
            String::new()
        }
    }
}

/// The strongest iron that nodal elements are to carry, and their limits.
fn nodal_iron<'a>(config: &Config, mesh: &'a Mesh, audits: &[Audited]) -> Option<(Iron<'a>, Limits)> {
    let limits = match (config.analysis.elements, config.analysis.order) {
        (Elements::Edge, _) => return None,
        (Elements::Nodal, ElementOrder::Linear) => Limits {
            doubtful: 4.0,
            refused: 10.0,
            wrong: "circuits of it and weak fields beside it may be wrong by factors",
        },
        (Elements::Nodal, ElementOrder::Quadratic) => {
            Limits { doubtful: 100.0, refused: 1000.0, wrong: "a circuit of it may lose most of its flux" }
        }
    };
    Some((strongest_iron(config, mesh, audits)?, limits))
}

/// The region that carries most flux, at the frequency at which it does.
fn strongest_iron<'a>(config: &Config, mesh: &'a Mesh, audits: &[Audited]) -> Option<Iron<'a>> {
    let is_static = config.frequencies().contains(&0.0);
    let of_matter = mesh.topology().region_names().iter().filter(|name| config.is_meshed(name));
    let iron = of_matter.map(|region| {
        let material = material(config, region);
        let relative_permeability = material.relative_permeability;
        let carrying = if is_static || material.conductivity == 0.0 {
            relative_permeability
        } else {
            let own = meshed(audits).filter(|audited| audited.audit.region == *region);
            // Of a curve no more than what stands for it: its largest permeability refuses nothing.
            own.map(|audited| audited.audit.carrying_permeability().min(relative_permeability))
                .fold(0.0, f64::max)
        };
        Iron { region, relative_permeability, carrying, is_of_curve: has_curve(config, region) }
    });
    iron.max_by(|a, b| a.carrying.total_cmp(&b.carrying))
}

/// What is doubtful beside iron.
fn beside_iron(config: &Config, mesh: &Mesh, audits: &[Audited]) -> Option<String> {
    if let Some((iron, limits)) = nodal_iron(config, mesh, audits) {
        return (iron.carrying > limits.doubtful).then(|| {
            format!(
                "region `{}` has the relative permeability {}{}, and nodal elements of order {}: {}. Set {CURE}",
                iron.region,
                iron.permeability(),
                iron.shielding(),
                u8::from(config.analysis.order),
                limits.wrong
            )
        });
    }
    let iron = strongest_iron(config, mesh, audits)?;
    (config.analysis.order == ElementOrder::Linear && iron.carrying > EDGE_DOUBTFUL).then(|| {
        format!(
            "region `{}` has the relative permeability {}, and edge elements of order 1 have one B an element: in slits and \
             thin walls of it that one or two elements cross B may be off by 10 to 20 %. Refine them, or set analysis.order = 2",
            iron.region,
            iron.permeability()
        )
    })
}
