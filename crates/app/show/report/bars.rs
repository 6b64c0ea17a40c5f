//! Rows of bars with their numbers: before above, after below.

use maud::{Markup, html};

use super::plot::{WIDTH, rect, text};

/// Height of the two bars of a row, and the room above the first one.
const ROW: f64 = 25.0;
const BAR: f64 = 9.0;
const ABOVE: f64 = 22.0;

/// Left end of the bars, and their longest.
pub(super) const START: f64 = 66.0;
const LONGEST: f64 = WIDTH - START - 58.0;

/// The class of a bar, its value and that as text.
pub(super) type Bar = (&'static str, f64, String);

/// The name of a row, and its bars from above; `None` leaves a place empty.
pub(super) type Row = (String, Vec<Option<Bar>>);

/// Rows under two titles, and the height they take; the longest bar is that of the value `most`.
pub(super) fn rows(titles: [&str; 2], rows: &[Row], most: f64) -> (Markup, f64) {
    let bar = |(class, value, number): &Bar, top: f64| {
        let length = LONGEST * value / most;
        // What is not zero is seen.
        let seen = if *value > 0.0 { length.max(0.8) } else { 0.0 };
        html! {
            (rect(class, [START, top, seen, BAR]))
            (text("count", START + length + 4.0, top + 8.0, number))
        }
    };
    let drawn = html! {
        (text("title", 2.0, 13.0, titles[0]))
        (text("title", START, 13.0, titles[1]))
        @for (k, (name, bars)) in rows.iter().enumerate() {
            @let top = ABOVE + ROW * k as f64;
            (text("tick end", START - 8.0, top + 15.0, name))
            @for (i, own) in bars.iter().enumerate() {
                @if let Some(own) = own { (bar(own, top + 2.0 + (BAR + 1.0) * i as f64)) }
            }
        }
    };
    (drawn, ABOVE + ROW * rows.len() as f64)
}
