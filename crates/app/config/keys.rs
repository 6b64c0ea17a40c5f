//! Every key of every table, for advice: a reader knows its own table only, and a key may have come into the wrong one.
//!
//! Advice is all this list is for. What is read, and how, stands with the readers; a test holds both together.

/// A table and its keys.
struct Keys {
    /// Its header as written, with `NAME` for a name of the user's.
    header: &'static str,
    keys: &'static [&'static str],
}

const fn table(header: &'static str, keys: &'static [&'static str]) -> Keys {
    Keys { header, keys }
}

const TABLES: &[Keys] = &[
    table("[mesh]", &["generator", "file", "unit"]),
    table(
        "[mesh.shield]",
        &[
            "plate",
            "pitch",
            "skin",
            "side_skin",
            "coil_half_window",
            "coil_width",
            "coil_z",
            "observation_x",
            "observation_y",
            "observation_z",
            "observation_cells",
            "remesh_upper",
            "remesh_z",
            "outer",
            "outer_z",
            "in_plane_size",
            "air_layer",
            "side_air",
            "growth",
            "refinement",
        ],
    ),
    table("[mesh.block]", &["size", "cells"]),
    table("[mesh.boxes]", &["box", "growth", "refinement", "regions", "sizes", "surfaces"]),
    table("[[mesh.boxes.regions]]", &["name", "box", "size", "skin", "cells"]),
    table("[[mesh.boxes.sizes]]", &["axis", "from", "to", "size"]),
    table("[[mesh.boxes.surfaces]]", &["name", "box"]),
    table(
        "[mesh.sphere]",
        &[
            "radius",
            "inner_radius",
            "outer_radius",
            "divisions",
            "skin",
            "wall_layers",
            "air_layer",
            "growth",
            "refinement",
        ],
    ),
    table("[analysis]", &["frequency", "frequencies", "penalty", "order", "linear_solver", "petsc"]),
    table("[analysis.linear_solver]", &["method", "factor_gib", "reuse", "tolerance"]),
    table("[analysis.petsc]", &["solver", "krylov", "overlap", "sub_solver", "options"]),
    table("[materials.NAME]", &["relative_permeability", "conductivity", "density"]),
    table("[regions.NAME]", &["material", "model", "remanence"]),
    table(
        "[[coils]]",
        &[
            "name",
            "ampere_turns",
            "phase",
            "shape",
            "center",
            "axis",
            "direction",
            "half_window",
            "radius",
            "width",
            "height",
            "corner",
            "inner_radius",
            "region",
            "terminals",
        ],
    ),
    table("[boundaries]", &["flux_parallel", "flux_normal", "uniform_field"]),
    table("[boundaries.uniform_field]", &["surfaces", "b", "center"]),
    table(
        "[objective]",
        &["goal", "kind", "region", "weighting", "target", "direction", "frequency", "weight", "terms"],
    ),
    table(
        "[[objective.terms]]",
        &["kind", "region", "weighting", "target", "direction", "frequency", "weight"],
    ),
    table(
        "[[constraints]]",
        &[
            "name",
            "kind",
            "region",
            "weighting",
            "target",
            "direction",
            "frequency",
            "upper",
            "upper_ratio",
            "minimum",
            "maximum",
        ],
    ),
    table(
        "[design]",
        &["surface", "direction", "grid", "filter_radius", "rim", "lower", "upper", "initial", "symmetry"],
    ),
    table("[[design.symmetry]]", &["axis", "at"]),
    table(
        "[remesh]",
        &[
            "region",
            "box",
            "poisson",
            "young",
            "force",
            "motion",
            "stiffness",
            "rounds",
            "inversion_share",
            "slide",
            "fixed",
            "free",
            "subregions",
        ],
    ),
    table("[[remesh.subregions]]", &["name", "young", "poisson", "force"]),
    table("[morph]", &["increments", "least_quality", "motion", "tune", "case"]),
    table(
        "[[morph.motion]]",
        &["surface", "line", "nodes", "box", "design", "displacement", "rotation", "scale"],
    ),
    table("[morph.motion.rotation]", &["axis", "center", "angle"]),
    table("[morph.motion.scale]", &["center", "factor"]),
    table("[morph.tune]", &["parameters", "evaluations", "log10_young", "poisson", "force"]),
    table("[[morph.case]]", &["name"]),
    table(
        "[morph.case.paper]",
        &[
            "worst_quality",
            "poor",
            "share_poor_percent",
            "share_fair_percent",
            "share_good_percent",
            "equations",
        ],
    ),
    table(
        "[optimizer]",
        &["algorithm", "max_evaluations", "max_time", "ftol_rel", "xtol_rel", "minimum_quality"],
    ),
    table("[[probes]]", &["name", "points"]),
    table("[output]", &["directory", "fields", "mesh", "stl", "verify_refinement", "report"]),
];

/// Tables whose keys are names of the user's.
const NAMED: [&str; 2] = ["materials", "regions"];

/// Most tables that advice names.
const MOST_OWNERS: usize = 3;

/// The keys of the table at a key path, such as `coils[0]`; none for one that only holds other tables.
pub(super) fn keys_at(path: &str) -> &'static [&'static str] {
    let name = written(path);
    TABLES.iter().find(|table| bare(table.header) == name).map_or(&[], |table| table.keys)
}

/// The headers of the tables that have a key, but for the one at a key path.
pub(super) fn owners(key: &str, path: &str) -> Vec<&'static str> {
    let own = written(path);
    let has = |table: &&Keys| bare(table.header) != own && table.keys.contains(&key);
    TABLES.iter().filter(has).map(|table| table.header).take(MOST_OWNERS).collect()
}

/// All keys of all tables, with the headers of these.
pub(super) fn all() -> impl Iterator<Item = (&'static str, &'static str)> {
    TABLES.iter().flat_map(|table| table.keys.iter().map(|key| (table.header, *key)))
}

/// The header of the table at a key path where it is written with brackets of its own.
pub(super) fn header(path: &str) -> Option<&'static str> {
    let name = written(path);
    TABLES.iter().map(|table| table.header).find(|header| bare(header) == name)
}

/// A header without brackets.
fn bare(header: &str) -> &str {
    header.trim_matches(['[', ']'])
}

/// A key path as headers write it: without numbers of items, with `NAME` for a name of the user's.
fn written(path: &str) -> String {
    let mut name = String::new();
    let mut inside = false;
    for c in path.chars() {
        inside = (inside || c == '[') && c != ']';
        if !inside && c != ']' {
            name.push(c);
        }
    }
    match name.split_once('.') {
        Some((table, _)) if NAMED.contains(&table) => format!("{table}.NAME"),
        _ => name,
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use serde_json::Value;

    use super::*;

    /// The schema behind references, of the items of a list, and of the tables with names of the user's.
    fn inner<'a>(document: &'a Value, mut schema: &'a Value) -> &'a Value {
        loop {
            schema = if let Some(name) = schema["$ref"].as_str() {
                &document["$defs"][name.trim_start_matches("#/$defs/")]
            } else if schema["items"].is_object() {
                &schema["items"]
            } else {
                return schema;
            };
        }
    }

    #[test]
    fn the_list_has_the_tables_and_keys_of_the_schema() {
        let document = crate::schema::document();
        // A case takes whatever it changes, and its own name.
        for table in TABLES.iter().filter(|table| table.header != "[[morph.case]]") {
            let step = |schema, key: &str| {
                let schema = inner(&document, schema);
                let next =
                    if key == "NAME" { &schema["additionalProperties"] } else { &schema["properties"][key] };
                inner(&document, next)
            };
            let found = bare(table.header).split('.').fold(&document, step)["properties"].as_object();
            // A table with brackets of its own below this one is no key of it.
            let is_key = |key: &&str| {
                !TABLES.iter().any(|other| {
                    bare(other.header) == format!("{}.{key}", bare(table.header)) && !table.keys.contains(key)
                })
            };
            let found = found.into_iter().flatten().map(|(key, _)| key.as_str());
            let found: BTreeSet<&str> = found.filter(is_key).collect();
            assert_eq!(found, table.keys.iter().copied().collect(), "{}", table.header);
        }
        let headers = TABLES.iter().flat_map(|table| bare(table.header).split('.'));
        let listed: BTreeSet<&str> = all().map(|(_, key)| key).chain(headers).collect();
        let tables = document["$defs"].as_object().expect("definitions");
        for (name, schema) in tables.iter().filter(|(name, _)| !name.ends_with("Overlay")) {
            for (key, _) in schema["properties"].as_object().into_iter().flatten() {
                assert!(listed.contains(key.as_str()), "`{key}` of {name} stands in no table of the list");
            }
        }
    }

    #[test]
    fn tables_are_found_by_key_path() {
        assert!(keys_at("coils[3]").contains(&"half_window"));
        assert!(keys_at("materials.soft steel").contains(&"density"));
        assert!(keys_at("morph.motion[0].rotation").contains(&"angle"));
        assert!(keys_at("nothing").is_empty());
        assert_eq!(header("coils"), Some("[[coils]]"));
        assert_eq!(header("regions"), None);
    }

    #[test]
    fn the_tables_of_a_key_are_named_without_its_own() {
        assert_eq!(owners("frequency", "mesh")[0], "[analysis]");
        assert_eq!(owners("algorithm", "design"), ["[optimizer]"]);
        assert_eq!(owners("angle", "morph.motion[1].rotation"), [""; 0]);
        assert_eq!(owners("nothing", ""), [""; 0]);
    }
}
