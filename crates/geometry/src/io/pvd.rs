//! ParaView collections (`.pvd`): which file belongs to which time.

use std::fmt::Write as _;

use crate::error::MeshError;

/// The text of a collection of (time, path relative to the collection) pairs, in the order given.
///
/// Times are written with as many digits as distinguish them.
///
/// # Errors
/// [`MeshError::NotFiniteArray`] if a time is not finite.
pub fn pvd_text<'a>(files: impl IntoIterator<Item = (f64, &'a str)>) -> Result<String, MeshError> {
    let mut text = String::from(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"LittleEndian\">\n  \
         <Collection>\n",
    );
    for (position, (time, path)) in files.into_iter().enumerate() {
        if !time.is_finite() {
            return Err(MeshError::NotFiniteArray { array: "timestep".into(), value: time, position });
        }
        writeln!(text, "    <DataSet timestep=\"{time}\" group=\"\" part=\"0\" file=\"{}\"/>", escape(path))
            .expect("writing into a string cannot fail");
    }
    text.push_str("  </Collection>\n</VTKFile>\n");
    Ok(text)
}

/// Text as the value of an XML attribute in double quotes.
fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&apos;"),
            // A bare line break or tab in an attribute is read as a blank.
            '\n' | '\r' | '\t' => {
                write!(out, "&#{};", u32::from(c)).expect("writing into a string cannot fail")
            }
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_collection_lists_its_files_in_order() {
        let text = pvd_text([(0.0, "fields/eval_0000.vtu"), (1.0, "fields/eval_0001.vtu")]).expect("finite");
        let expected = r#"<?xml version="1.0"?>
<VTKFile type="Collection" version="1.0" byte_order="LittleEndian">
  <Collection>
    <DataSet timestep="0" group="" part="0" file="fields/eval_0000.vtu"/>
    <DataSet timestep="1" group="" part="0" file="fields/eval_0001.vtu"/>
  </Collection>
</VTKFile>
"#;
        assert_eq!(text, expected);
    }

    #[test]
    fn paths_are_escaped_and_times_finite() {
        let text = pvd_text([(0.5, "a<b>&\"c'\t.vtu")]).expect("finite");
        assert!(text.contains("timestep=\"0.5\""), "{text}");
        assert!(text.contains("file=\"a&lt;b&gt;&amp;&quot;c&apos;&#9;.vtu\""), "{text}");
        assert!(matches!(
            pvd_text([(f64::NAN, "a.vtu")]),
            Err(MeshError::NotFiniteArray { position: 0, .. })
        ));
    }
}
