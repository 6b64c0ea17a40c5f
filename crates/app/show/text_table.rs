//! Columns of text that are as wide as their longest cell.

/// Where the cells of a column stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Align {
    /// Words.
    Left,
    /// Numbers.
    Right,
}

/// A table with a header.
#[derive(Debug)]
pub(crate) struct Table<const N: usize> {
    columns: [Align; N],
    rows: Vec<[String; N]>,
}

impl<const N: usize> Table<N> {
    /// A table of the columns with these names, and its rows.
    pub(crate) fn new(columns: [(&str, Align); N], rows: impl IntoIterator<Item = [String; N]>) -> Self {
        let header = columns.map(|(name, _)| name.to_owned());
        Self { columns: columns.map(|(_, align)| align), rows: std::iter::once(header).chain(rows).collect() }
    }

    /// A name and numbers in every row.
    pub(crate) fn of_numbers(names: [&str; N], rows: impl IntoIterator<Item = [String; N]>) -> Self {
        let align = |k: usize| if k == 0 { Align::Left } else { Align::Right };
        Self::new(std::array::from_fn(|k| (names[k], align(k))), rows)
    }

    /// The lines, each with its break, after an empty one; nothing where the table has no row.
    pub(crate) fn text(&self) -> String {
        if self.rows.len() == 1 {
            return String::new();
        }
        let width =
            |column: usize| self.rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
        let widths: [usize; N] = std::array::from_fn(width);
        let mut text = String::from("\n");
        for row in &self.rows {
            let mut line = String::new();
            for (column, cell) in row.iter().enumerate() {
                let blanks = " ".repeat(widths[column] - cell.chars().count());
                line += if column == 0 { "" } else { "  " };
                line += &match self.columns[column] {
                    Align::Left => format!("{cell}{blanks}"),
                    Align::Right => format!("{blanks}{cell}"),
                };
            }
            text += line.trim_end();
            text.push('\n');
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_as_wide_as_their_longest_cell() {
        let columns = [("region", Align::Left), ("tets", Align::Right), ("in", Align::Left)];
        assert_eq!(Table::new(columns, []).text(), "");
        let rows = [["a region with a name as long as this", "7", "µ"], ["b", "12345", ""]];
        let text = Table::new(columns, rows.map(|row| row.map(str::to_owned))).text();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[1], format!("{:<36}  {:>5}  in", "region", "tets"));
        assert_eq!(lines[2], "a region with a name as long as this      7  µ");
        assert_eq!(lines[3], format!("{:<36}  12345", "b"));
    }
}
