//! The B–H curves of a configuration, from its own lists and from files.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;
use std::sync::Arc;

use fluxmorph_geometry::io::open_regular;
use fluxmorph_solver::BhCurve;

use crate::config::{Config, Diagnostic, SourceMap};
use crate::error::Error;

/// Largest table that is read [bytes]: a thousand times the longest one that was ever measured.
const LARGEST_FILE: u64 = 1024 * 1024;

/// Curves by the name of their material.
#[derive(Debug, Default)]
pub(super) struct Curves(BTreeMap<String, Arc<BhCurve>>);

impl Curves {
    /// Those of all materials, or the faults of all of them.
    pub(super) fn read(config: &Config, source: &SourceMap) -> Result<Self, Error> {
        let (mut curves, mut faults) = (BTreeMap::new(), Vec::new());
        for (name, material) in &config.materials {
            let curve = match (&material.bh, &material.bh_file) {
                (Some(points), _) => listed(name, points, source),
                (None, Some(path)) => filed(name, path, source),
                (None, None) => continue,
            };
            match curve {
                Ok(curve) => _ = curves.insert(name.clone(), Arc::new(curve)),
                Err(fault) => faults.push(*fault),
            }
        }
        source.check(faults)?;
        Ok(Self(curves))
    }

    /// The curve of a region's material.
    pub(super) fn of(&self, config: &Config, region: &str) -> Option<Arc<BhCurve>> {
        self.0.get(&config.regions.get(region)?.material).cloned()
    }

    /// What is not wrong with a curve, but seldom meant.
    pub(super) fn warnings(&self) -> Vec<String> {
        let warning = |(name, curve): (&String, &Arc<BhCurve>)| {
            let [h, b] = curve.end();
            (!curve.ends_saturated()).then(|| {
                format!(
                    "materials.{name}: the B–H curve ends at {b} T and {h} A/m with a slope of more than 2 μ0, before the \
                     material is saturated; beyond, it is taken as saturated at once"
                )
            })
        };
        self.0.iter().filter_map(warning).collect()
    }
}

/// A curve of the configuration itself; a fault stands at its point.
fn listed(name: &str, points: &[[f64; 2]], source: &SourceMap) -> Result<BhCurve, Box<Diagnostic>> {
    BhCurve::new(points).map_err(|(row, fault)| {
        let path = format!("materials.{name}.bh[{row}]");
        Box::new(
            source.diagnostic(&path, fault.to_string()).expected("points [H, B] [A/m, T], both ascending"),
        )
    })
}

/// A curve from a file; a fault names its line.
fn filed(name: &str, path: &Path, source: &SourceMap) -> Result<BhCurve, Box<Diagnostic>> {
    let refused = |place: String, message: String| {
        let key = format!("materials.{name}.bh_file");
        let message = format!("`{}`{place}: {message}", path.display());
        let expected = "lines of H [A/m], B [T], both ascending, with a comma between them";
        Box::new(source.diagnostic(&key, message).expected(expected))
    };
    let mut text = String::new();
    let read = open_regular(path).and_then(|file| file.take(LARGEST_FILE).read_to_string(&mut text));
    read.map_err(|error| refused(String::new(), error.to_string()))?;
    let is_row = |line: &str| !line.trim().is_empty() && !line.trim_start().starts_with('#');
    let mut lines = Vec::new();
    let mut points = Vec::new();
    for (number, line) in text.lines().enumerate().filter(|(_, line)| is_row(line)) {
        let at = |message: &str| refused(format!(", line {}", number + 1), message.to_owned());
        let fields: Vec<&str> = line.split(',').map(str::trim).collect();
        let &[h, b] = fields.as_slice() else {
            return Err(at(&format!("{} columns, not 2", fields.len())));
        };
        let number_in = |field: &str| {
            field.parse::<f64>().map_err(|_| at(&format!("`{}` is no number", field.escape_debug())))
        };
        points.push([number_in(h)?, number_in(b)?]);
        lines.push(number + 1);
    }
    BhCurve::new(&points).map_err(|(row, fault)| {
        let place = lines.get(row).map_or_else(String::new, |line| format!(", line {line}"));
        refused(place, fault.to_string())
    })
}
