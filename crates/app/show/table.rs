//! The row that an evaluation leaves on a terminal or in a log, and the header over it.

use fluxmorph_geometry::Millimetres;

use super::Evaluation;

/// How much a row says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Columns {
    /// Everything.
    All,
    /// What fits on a terminal of 80 columns: without the norm of the gradient and the iterations of the linear solver.
    Compact,
}

/// Width of the column of thicknesses.
const THICKNESS: usize = 15;

/// The last column, of a width that common names of constraints fit into.
fn worst_of(text: &str) -> String {
    format!("  {text:<24.40}")
}

/// The header over a row like `row`.
pub(super) fn header(row: &Evaluation, columns: Columns) -> String {
    let constraint = if row.constraints.is_empty() { String::new() } else { worst_of("worst constraint") };
    line(
        columns,
        ["eval", "iter", "F", "F/F0", "|dF/dp|", "step mm", "quality", "thickness mm", "linear", "s"],
    ) + &constraint
}

/// An evaluation.
pub(super) fn row(row: &Evaluation, columns: Columns) -> String {
    let constraint = row
        .constraints
        .iter()
        .max_by(|a, b| a.1.total_cmp(b.1))
        .map(|(column, c)| worst_of(&format!("{c:+.1e} {}", column.trim_start_matches("c_"))))
        .unwrap_or_default();
    let thickness = match (row.min_thickness_m, row.max_thickness_m) {
        (Some(least), Some(most)) => {
            let [least, most] = [least, most].map(|length| format!("{:.2}", Millimetres(length)));
            let blank = if least.len() + most.len() + 4 > THICKNESS { "" } else { " " };
            format!("{least}{blank}..{blank}{most}")
        }
        _ => "-".to_owned(),
    };
    let cells = [
        row.evaluation.to_string(),
        row.iteration.to_string(),
        format!("{:.6e}", row.objective),
        super::ratio(row.ratio),
        format!("{:.2e}", row.gradient_norm),
        format!("{:.3}", Millimetres(row.step_norm)),
        format!("{:.4}", row.worst_quality),
        thickness,
        row.linear_iterations.to_string(),
        format!("{:.2}", row.seconds),
    ];
    line(columns, cells.each_ref().map(String::as_str)) + &constraint
}

fn line(columns: Columns, cells: [&str; 10]) -> String {
    let [eval, iter, f, ratio, gradient, step, quality, thickness, linear, seconds] = cells;
    match columns {
        Columns::All => format!(
            "{eval:>4} {iter:>4} {f:>13} {ratio:>8} {gradient:>9} {step:>9} {quality:>8} {thickness:>THICKNESS$} {linear:>6} \
             {seconds:>7}"
        ),
        Columns::Compact => {
            format!(
                "{eval:>4} {iter:>4} {f:>13} {ratio:>8} {step:>9} {quality:>8} {thickness:>THICKNESS$} {seconds:>7}"
            )
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::evaluation;
    use super::*;

    #[test]
    fn rows_stand_under_their_header() {
        for (columns, width) in [(Columns::All, 92), (Columns::Compact, 75)] {
            for number in [0, 10, 999] {
                let evaluation = evaluation(number);
                assert_eq!(header(&evaluation, columns).len(), width);
                assert_eq!(row(&evaluation, columns).len(), width);
            }
        }
        let text = row(&evaluation(1), Columns::Compact);
        assert!(text.contains("5.00 .. 30.00") && text.contains("0.51000"), "{text}");
    }

    #[test]
    fn a_row_names_its_worst_constraint() {
        let constraints = [("c_volume_plate", -1e-3), ("c_loss", 0.25)].map(|(name, c)| (name.to_owned(), c));
        let evaluation = Evaluation { constraints: constraints.into(), ..evaluation(1) };
        let (header, row) = (header(&evaluation, Columns::All), row(&evaluation, Columns::All));
        assert!(header.contains("worst constraint") && row.contains("+2.5e-1 loss"), "{header}\n{row}");
        assert_eq!(header.len(), row.len());
    }
}
