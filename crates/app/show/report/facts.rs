//! Names and values: the mesh and its linear systems, and where the run comes from.

use std::path::Path;

use fluxmorph_geometry::Mesh;
use maud::{Markup, html};

use super::data::RunData;
use super::ticks::{decimals_of, duration, group_digits, number, threads, trim_zeros};
use crate::config::Elements;
use crate::files::{Manifest, shell_word};

/// Names and values in their order.
#[derive(Default)]
struct Facts(Vec<(&'static str, String)>);

impl Facts {
    fn add(&mut self, name: &'static str, value: String) {
        self.0.push((name, value));
    }

    fn list(self) -> Markup {
        html! { dl { @for (name, value) in self.0 { div { dt { (name) } dd { (value) } } } } }
    }
}

/// Mesh and linear systems.
pub(super) fn mesh(data: &RunData) -> Markup {
    let size = |nodes: usize, tets: usize| {
        format!("{} nodes, {} tetrahedra", group_digits(nodes), group_digits(tets))
    };
    let mut facts = Facts::default();
    if let Some(mesh) = &data.manifest.mesh {
        facts.add("mesh of the configuration", size(mesh.nodes, mesh.tets));
    }
    if let Some(result) = &data.result {
        let mesh = &result.mesh;
        facts.add("mesh that is solved on", size(mesh.nodes, mesh.tets));
        facts.add("unknowns", group_digits(mesh.unknowns));
        let quality = [mesh.worst_quality_initial, mesh.worst_quality_final].map(|q| number(q, 3));
        facts.add("worst quality", if data.is_run() { quality.join(" → ") } else { quality[1].clone() });
        facts.add("linear solver", result.linear_solver.methods.join(", "));
        facts.add("largest relative residual", number(result.linear_solver.worst_residual, 2));
        if let Some(near_wall) = result.accuracy.as_ref().and_then(|accuracy| accuracy.near_wall.clone()) {
            facts.add("nearest wall", near_wall);
        }
    }
    let order = if u8::from(data.config.analysis.order) == 1 { "linear" } else { "quadratic" };
    let family = match data.config.analysis.elements {
        Elements::Edge => "edge A, nodal ψ".to_owned(),
        Elements::Nodal => format!("nodal A–ψ, ν_p/ν = {}", trim_zeros(data.config.analysis.penalty, 4)),
    };
    facts.add("elements", format!("{order} tetrahedra, {family}"));
    if let Ok(outline) = &data.outline {
        facts.add("bounding box", bounding_box(&outline.full_mesh));
        if let Some(design) = &outline.design {
            let [nodes, triangles] = [design.surface.nodes().len(), design.triangles.len()].map(group_digits);
            facts.add("design surface", format!("{nodes} nodes, {triangles} triangles"));
            facts.add("elements that may move", group_digits(design.moving.len()));
        }
    }
    facts.list()
}

fn bounding_box(mesh: &Mesh) -> String {
    let corners = mesh.bounding_box().map(|p| p.map(|c| 1e3 * c));
    let decimals = decimals_of(&corners.concat(), 1);
    let [low, high] = corners.map(|p| p.map(|c| trim_zeros(c, decimals)).join(", "));
    format!("({low}) to ({high}) mm")
}

/// Where the run comes from.
pub(super) fn provenance(data: &RunData) -> Markup {
    let manifest = &data.manifest;
    let mut facts = Facts::default();
    facts.add("program", format!("fluxmorph {}", manifest.version));
    facts.add("command", command(manifest));
    if let Some(limits) = &manifest.limits {
        let time = limits.max_time_s.map_or(String::new(), |seconds| format!(", {}", duration(seconds)));
        facts.add("limits", format!("{} evaluations{time}", limits.max_evaluations));
    }
    if let Some(config) = &manifest.config {
        facts.add("configuration, BLAKE3", config.blake3.clone());
    }
    if let Some(mesh) = &manifest.mesh {
        facts.add("mesh", mesh.origin.clone());
        facts.add("mesh, BLAKE3", mesh.blake3.clone());
    }
    let host = &manifest.host;
    let machine = format!("{}, {} {}", host.name, host.system, host.architecture);
    facts.add("machine", format!("{machine}, {} used", threads(manifest.threads)));
    facts.add("started", manifest.started.clone());
    for resumption in &manifest.resumed {
        let place = format!("{} on {}", resumption.at, resumption.host.name);
        let work = format!("{} evaluations, {}", resumption.evaluations, threads(resumption.threads));
        facts.add("resumed", format!("{place}, after {work}"));
    }
    if let Some(finished) = &manifest.finished {
        facts.add("finished", finished.clone());
    }
    if let Some(result) = &data.result {
        let parts = result.timings_s.iter().filter(|(part, _)| *part != "total");
        let parts =
            parts.map(|(part, seconds)| format!("{} {} s", part.replace('_', " "), number(*seconds, 2)));
        facts.add("time by parts", parts.collect::<Vec<_>>().join(", "));
        facts.add("peak memory", format!("{} MiB", result.peak_memory_bytes.div_ceil(1 << 20)));
    }
    facts.list()
}

/// The command as it was given, for a shell.
fn command(manifest: &Manifest) -> String {
    let path = manifest.config.as_ref().map_or("", |config| config.path.as_str());
    let overlays = manifest.overrides.iter().map(|o| format!(" --set {}", shell_word(Path::new(o.trim()))));
    let overlays: String = overlays.collect();
    format!("fluxmorph {} {}{overlays}", manifest.command, shell_word(Path::new(path)))
}
