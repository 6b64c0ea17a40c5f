//! The B–H curves of a configuration, from its own lists and from files.

use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use fluxmorph_geometry::io::read_at_most;
use fluxmorph_solver::BhCurve;
use fluxmorph_solver::bh::{Analytic, Knee};

use super::plausible::MOST_PERMEABILITY;
use super::steels;
use crate::config::{Config, Diagnostic, KneeWord, Material, SourceMap, WrittenCurve};
use crate::error::Error;
use crate::files::blake3_hex;

/// Largest table that is read [bytes]: a thousand times the longest one that was ever measured.
pub(crate) const LARGEST_TABLE: u64 = 1024 * 1024;

/// Largest saturation polarisation [T]: four times that of iron and cobalt. More is another unit.
const LARGEST_POLARISATION: f64 = 10.0;

/// Curves by the name of their material.
#[derive(Debug, Default)]
pub(super) struct Curves {
    curves: BTreeMap<String, Arc<BhCurve>>,
    files: BTreeMap<PathBuf, String>,
    /// Whether nothing alternates.
    is_static: bool,
}

impl Curves {
    /// Those of all materials, or the faults of all of them.
    pub(super) fn read(config: &Config, source: &SourceMap) -> Result<Self, Error> {
        let (mut curves, mut files, mut faults) = (BTreeMap::new(), BTreeMap::new(), Vec::new());
        for (name, material) in &config.materials {
            let curve = match (&material.bh, &material.bh_file, material.saturation) {
                (Some(WrittenCurve::Points(points)), ..) => listed(name, points, source),
                (Some(WrittenCurve::Named(steel)), ..) => Ok(steels::curve(*steel)),
                (None, Some(path), _) => filed(name, path, source).map(|(curve, hash)| {
                    files.insert(path.clone(), hash);
                    curve
                }),
                (None, None, Some(saturation)) => closed(name, material, saturation, source),
                (None, None, None) => continue,
            };
            match curve {
                Ok(curve) => _ = curves.insert(name.clone(), Arc::new(curve)),
                Err(fault) => faults.push(*fault),
            }
        }
        source.check(faults)?;
        let is_static = !config.alternates();
        Ok(Self { curves, files, is_static })
    }

    /// The files that were read, with BLAKE3 of their content.
    pub(super) fn into_files(self) -> BTreeMap<PathBuf, String> {
        self.files
    }

    /// The curve of a region's material.
    pub(super) fn of(&self, config: &Config, region: &str) -> Option<Arc<BhCurve>> {
        self.curves.get(&config.regions.get(region)?.material).cloned()
    }

    /// What is not wrong with a curve, but seldom meant.
    pub(super) fn warnings(&self, config: &Config) -> Vec<String> {
        let used = |name: &String| {
            config.regions.iter().any(|(region, own)| own.material == *name && config.is_meshed(region))
        };
        let warning = |(name, curve): (&String, &Arc<BhCurve>)| {
            let [h, b] = curve.end().filter(|_| !curve.ends_saturated())?;
            Some({
                format!(
                    "materials.{name}: the B–H curve ends at {b} T and {h} A/m with a slope of more than 2 μ0, before the \
                     material is saturated; beyond, it is taken as saturated at once"
                )
            })
        };
        let steep = |(name, curve): (&String, &Arc<BhCurve>)| {
            let permeability = curve.largest_permeability();
            (permeability > MOST_PERMEABILITY).then(|| {
                format!(
                    "materials.{name}: the B–H curve has a relative permeability of {permeability:.1e}, more than any material: \
                     is H in A/m?"
                )
            })
        };
        let falling = |(name, curve): (&String, &Arc<BhCurve>)| {
            let [h, b] = curve.falling_polarisation()?;
            Some(format!(
                "materials.{name}: B rises by less than μ0 H up to the point of {h} A/m and {b} T of the B–H curve, so that the \
                 polarisation falls there, as that of no steel does: a saturated one goes on with μ0 = 1.2566e-6 T/(A/m)"
            ))
        };
        let approximation = (!self.is_static && self.curves.keys().any(used)).then(|| {
            "iron with a B–H curve above 0 Hz: the largest and the least |B| of a period follow the curve, and of what alternates \
             the fundamental alone is computed (effective reluctivity). That is an approximation, which no error bar counts: far \
             beyond the knee, where the current is given and the field alternates in one direction, fluxes and voltages are up to \
             21 % too low, mean forces and energies up to 50 %, and losses of eddy currents about 10 %; where a voltage gives the \
             flux, the current is its peak, of which the fundamental may be a fifth"
                .to_owned()
        });
        let of_curves = self.curves.iter().filter(|(name, _)| used(name));
        let of_curves = of_curves.flat_map(|own| [steep(own), falling(own), warning(own)]);
        of_curves.flatten().chain(approximation).collect()
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

/// A curve in closed form.
fn closed(
    name: &str,
    material: &Material,
    saturation: f64,
    source: &SourceMap,
) -> Result<BhCurve, Box<Diagnostic>> {
    let knee = match material.knee {
        None | Some(KneeWord::Sharp) => Knee::Sharp,
        Some(KneeWord::Arctangent) => Knee::Arctangent,
    };
    let law = Analytic::new(material.relative_permeability, saturation, knee);
    law.filter(|_| saturation <= LARGEST_POLARISATION).map(BhCurve::analytic).ok_or_else(|| {
        let path = format!("materials.{name}.saturation");
        let message = format!("{saturation} T is beyond any material");
        Box::new(source.diagnostic(&path, message).expected("at most 10 T: iron and cobalt have 2.4 T"))
    })
}

/// A curve from a file, with BLAKE3 of it; a fault names its line.
fn filed(name: &str, path: &Path, source: &SourceMap) -> Result<(BhCurve, String), Box<Diagnostic>> {
    let refused = |place: String, message: String| {
        let key = format!("materials.{name}.bh_file");
        let message = format!("`{}`{place}: {message}", path.display());
        let expected =
            "lines of H [A/m], B [T], both ascending, with a comma between them; a header begins with #";
        Box::new(source.diagnostic(&key, message).expected(expected))
    };
    let whole = |message: String| refused(String::new(), message);
    let bytes = read_at_most(path, LARGEST_TABLE).map_err(|error| match error.kind() {
        ErrorKind::NotFound => Box::new(source.no_file(&format!("materials.{name}.bh_file"), path)),
        ErrorKind::FileTooLarge => {
            whole(format!("it has more than {LARGEST_TABLE} bytes, and a curve takes some hundred points"))
        }
        _ => whole(error.to_string()),
    })?;
    let text = String::from_utf8(bytes).map_err(|_| whole("it is no text in UTF-8".to_owned()))?;
    let hash = blake3_hex(text.as_bytes());
    let mut lines = Vec::new();
    let mut points = Vec::new();
    // Spreadsheets begin a file with a mark of its encoding.
    let rows = text.strip_prefix('\u{feff}').unwrap_or(&text).lines().enumerate();
    for (number, line) in rows.filter(|(_, line)| steels::is_row(line)) {
        let at = |message: &str| refused(format!(", line {}", number + 1), message.to_owned());
        let fields: Vec<&str> = line.split(',').map(str::trim).collect();
        let &[h, b] = fields.as_slice() else {
            let marks = [(';', "a semicolon"), ('\t', "a tab"), (' ', "a space")];
            let separator = marks.into_iter().find(|(mark, _)| line.trim().contains(*mark));
            return Err(at(&match separator.filter(|_| fields.len() == 1) {
                Some((_, name)) => format!("{name} separates the columns, not a comma"),
                None => format!("{} columns, not 2", fields.len()),
            }));
        };
        let number_in = |field: &str| {
            field.parse::<f64>().map_err(|_| at(&format!("`{}` is no number", field.escape_debug())))
        };
        points.push([number_in(h)?, number_in(b)?]);
        lines.push(number + 1);
    }
    let curve = BhCurve::new(&points).map_err(|(row, fault)| {
        let place = lines.get(row).map_or_else(String::new, |line| format!(", line {line}"));
        refused(place, fault.to_string())
    })?;
    Ok((curve, hash))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two sound lines, a comment and an empty line, then what is to be refused at line 5.
    const HEAD: &str = "# H, B\n100, 0.5\n\n1000, 1.5\n";

    #[test]
    fn a_bad_line_of_a_file_is_refused_by_its_number() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let (table, path) = (folder.path().join("steel.csv"), folder.path().join("a.toml"));
        let config = "[mesh]\ngenerator = \"block\"\n[analysis]\nfrequency = 0\n[materials.steel]\nbh_file = \"steel.csv\"\n\
                      [regions.block]\nmaterial = \"steel\"\n[boundaries]\nflux_parallel = [\"x_min\"]\n";
        std::fs::write(&path, config).expect("written");
        let (config, source) = Config::from_file(&path, &[]).expect("a sound configuration");
        let of_line_5 = [
            ("2000", "1 columns, not 2"),
            ("2000, 1.6, 3", "3 columns, not 2"),
            ("2000; 1.6", "a semicolon separates the columns"),
            ("2000\t1.6", "a tab separates the columns"),
            ("2000  1.6", "a space separates the columns"),
            ("2 kA/m, 1.6", "`2 kA/m` is no number"),
            ("2000, -", "`-` is no number"),
            ("nan, 1.6", "not finite"),
            ("-2000, 1.6", "negative"),
            ("1000, 1.6", "does not increase"),
            ("900, 1.6", "does not increase"),
            ("2000, 1.5", "does not increase"),
            ("2000, 1.4", "does not increase"),
            ("2e6, 1.6", "less than in vacuum"),
            ("2000, 16", "beyond any material"),
        ];
        for (line, word) in of_line_5 {
            std::fs::write(&table, format!("{HEAD}{line}\n100000, 2.2\n")).expect("written");
            let message = Curves::read(&config, &source).expect_err("it is no law").to_string();
            let is_at_its_line = message.contains("steel.csv`, line 5") && message.contains(word);
            assert!(is_at_its_line, "{line}: {message}");
        }
        std::fs::write(&table, format!("\u{feff}{HEAD}100000, 2.2\n")).expect("written");
        let curves = Curves::read(&config, &source).expect("a sound table");
        assert_eq!(curves.into_files().len(), 1);
        // A long table is not cut.
        let long = format!("{HEAD}{}100000, 2.2\n", "# a line without a point\n".repeat(50_000));
        std::fs::write(&table, long).expect("written");
        let message = Curves::read(&config, &source).expect_err("too long").to_string();
        assert!(message.contains("it has more than 1048576 bytes"), "{message}");
        std::fs::write(&table, b"H\0,\0\xff\xfe").expect("written");
        let message = Curves::read(&config, &source).expect_err("UTF-16").to_string();
        assert!(message.contains("it is no text in UTF-8"), "{message}");
    }
}
