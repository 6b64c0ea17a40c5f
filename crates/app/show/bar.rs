//! A bar on a terminal: the last line shows where the work is, finished evaluations are above it.
//!
//! The only module that names indicatif. There is one terminal, so there is one bar: [`clear`] removes it from any thread,
//! for messages of signals and panics.

use std::io::{IsTerminal, Write};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use fluxmorph_optimizer::problem::Stage;
use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressStyle, WeakProgressBar};

use super::lines::Lines;
use super::table::Columns;
use super::{Evaluation, Observer, RunObserver, Started, Styles, show};
use crate::files::RunResult;
use crate::printable::printable;

/// How often times on the bar move on.
const TICK: Duration = Duration::from_millis(200);

/// A part of the work and its time.
const WORK: &str = "{spinner} {wide_msg} {elapsed}";

/// The same within a run, after what is known from its last evaluation.
const RUN: &str = "{spinner} {pos}/{len} [{bar:10}] {prefix}  {wide_msg} {elapsed}";

/// The bar on the terminal.
static SHOWN: Mutex<Option<WeakProgressBar>> = Mutex::new(None);

/// Removes the bar from the terminal for good; its owner continues in plain lines.
pub fn clear() {
    // Never waits: the thread that holds it may be the one that panics.
    let Ok(mut shown) = SHOWN.try_lock() else { return };
    if let Some(bar) = shown.take().and_then(|bar| bar.upgrade()) {
        bar.finish_and_clear();
    }
}

/// Shows a bar, and lines above it.
#[derive(Debug)]
pub struct Bar<W> {
    bar: ProgressBar,
    writer: W,
    lines: Lines,
    /// The template of the stages.
    template: &'static str,
}

impl Bar<std::io::Stderr> {
    /// On standard error; `None` where that is no terminal that can show a bar.
    pub fn stderr() -> Option<Self> {
        let is_dumb = std::env::var_os("TERM").is_none_or(|term| term == "dumb" || term.is_empty());
        if !std::io::stderr().is_terminal() || (cfg!(unix) && is_dumb) {
            return None;
        }
        let target = ProgressDrawTarget::stderr();
        (!target.is_hidden()).then(|| {
            let mut bar = Self::new(target, std::io::stderr());
            bar.lines = Lines::new(Styles::for_stderr(), Columns::Compact);
            bar.bar.enable_steady_tick(TICK);
            *SHOWN.lock().unwrap_or_else(PoisonError::into_inner) = Some(bar.bar.downgrade());
            bar
        })
    }
}

impl<W: Write> Bar<W> {
    /// On any target, without colours; `writer` leads to the same place.
    pub fn new(target: ProgressDrawTarget, writer: W) -> Self {
        let bar = ProgressBar::with_draw_target(None, target).with_style(style(WORK));
        let lines = Lines::new(Styles::default(), Columns::Compact);
        Self { bar, writer, lines, template: WORK }
    }

    /// Shows what is being done, timed from now.
    fn work(&self, template: &str, what: &str) {
        // Whoever cleared the bar wants it gone for good: a change would draw it again.
        if !self.bar.is_finished() {
            self.bar.set_style(style(template));
            self.bar.set_message(printable(what).into_owned());
            self.bar.reset_elapsed();
        }
    }

    /// Shows a line that may have styles, above the bar.
    fn styled_line(&mut self, text: &str) {
        let Self { bar, writer, .. } = self;
        if bar.is_finished() {
            show(writer, text);
        } else {
            bar.suspend(|| show(writer, text));
        }
    }
}

fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template)
        .expect("the template is a constant")
        .tick_chars("|/-\\ ")
        .progress_chars("= ")
}

impl<W: Write> Observer for Bar<W> {
    fn line(&mut self, text: &str) {
        self.styled_line(&printable(text));
    }

    fn phase(&mut self, name: &str) {
        self.work(WORK, name);
    }

    fn stage(&mut self, stage: Stage) {
        self.work(self.template, stage.describe());
    }

    fn evaluation(&mut self, row: &Evaluation) {
        self.lines.evaluation(row).iter().for_each(|line| self.styled_line(line));
        if self.bar.is_finished() {
            return;
        }
        let done = row.evaluation as u64 + 1;
        // At most: the run may converge before. The library's estimate forgets all that is older than a quarter of a
        // minute, which is less than an evaluation may take.
        let left = self.bar.length().unwrap_or(done).saturating_sub(done) as f64 * row.seconds;
        let left = HumanDuration(Duration::try_from_secs_f64(left).unwrap_or(Duration::MAX));
        let (ratio, quality) = (row.ratio, row.worst_quality);
        self.bar.set_prefix(format!("F/F0 {ratio:.4}  quality {quality:.3}  ETA {left:#}"));
        self.bar.set_position(done);
    }

    fn warning(&mut self, message: &str) {
        let line = self.lines.warning(message);
        self.styled_line(&line);
    }
}

impl<W: Write> RunObserver for Bar<W> {
    fn started(&mut self, started: &Started<'_>) {
        self.lines.started(started).iter().for_each(|line| self.styled_line(line));
        if let Some(optimizer) = started.optimizer {
            self.bar.set_length(optimizer.max_evaluations as u64);
            self.template = RUN;
        }
    }

    fn finished(&mut self, result: &RunResult) {
        self.bar.finish_and_clear();
        self.lines.finished(result).iter().for_each(|line| self.styled_line(line));
    }
}

impl<W> Drop for Bar<W> {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use indicatif::TermLike;

    use super::super::tests::evaluation;
    use super::*;
    use crate::config::{FieldsKept, Optimizer};

    /// A terminal of 80 columns that keeps all that is written, and forgets what is cleared.
    #[derive(Debug, Clone, Default)]
    struct Screen(Arc<Mutex<Vec<String>>>);

    impl Screen {
        fn lines(&self) -> Vec<String> {
            self.0.lock().expect("no test panics with it").clone()
        }

        fn add(&self, text: &str) {
            let mut lines = self.0.lock().expect("no test panics with it");
            for (k, part) in text.split('\n').enumerate() {
                match lines.last_mut().filter(|_| k == 0) {
                    Some(last) => last.push_str(part),
                    None => lines.push(part.to_owned()),
                }
            }
        }
    }

    impl Write for Screen {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            self.add(&String::from_utf8_lossy(bytes));
            Ok(bytes.len())
        }
        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }

    impl TermLike for Screen {
        fn width(&self) -> u16 {
            80
        }
        fn move_cursor_up(&self, _: usize) -> std::io::Result<()> {
            Ok(())
        }
        fn move_cursor_down(&self, _: usize) -> std::io::Result<()> {
            Ok(())
        }
        fn move_cursor_right(&self, _: usize) -> std::io::Result<()> {
            Ok(())
        }
        fn move_cursor_left(&self, _: usize) -> std::io::Result<()> {
            Ok(())
        }
        fn write_line(&self, text: &str) -> std::io::Result<()> {
            self.add(&format!("{text}\n"));
            Ok(())
        }
        fn write_str(&self, text: &str) -> std::io::Result<()> {
            self.add(text.trim_end());
            Ok(())
        }
        fn clear_line(&self) -> std::io::Result<()> {
            if let Some(last) = self.0.lock().expect("no test panics with it").last_mut() {
                last.clear();
            }
            Ok(())
        }
        fn flush(&self) -> std::io::Result<()> {
            Ok(())
        }
    }

    fn bar(screen: &Screen) -> Bar<Screen> {
        Bar::new(ProgressDrawTarget::term_like(Box::new(screen.clone())), screen.clone())
    }

    fn started(optimizer: &Optimizer) -> Started<'_> {
        Started {
            title: "Plate",
            optimizer: Some(optimizer),
            objective: None,
            constraints: &[],
            variables: 91,
            filter_radius: None,
            motion: None,
            nodes: 100,
            tets: 400,
            unknowns: 350,
            directory: None,
            fields: FieldsKept::Every,
        }
    }

    #[test]
    fn rows_stand_above_the_bar_and_nothing_is_left_of_it() {
        let screen = Screen::default();
        let mut observer = bar(&screen);
        observer.started(&started(&Optimizer { max_evaluations: 4, ..Optimizer::default() }));
        observer.stage(Stage::Factoring);
        observer.evaluation(&evaluation(0));
        observer.stage(Stage::Adjoint);
        let lines = screen.lines();
        let last = lines.last().expect("a bar");
        for part in ["1/4 [==        ]", "F/F0 0.5100", "quality 0.100", "ETA 3s", "adjoint"] {
            assert!(last.contains(part), "{part}: {lines:#?}");
        }
        assert_eq!(lines.iter().filter(|line| line.contains("/4 [")).count(), 1, "{lines:#?}");
        assert_eq!(lines[0], "Plate");
        assert!(lines.iter().any(|line| line.contains("5.00 .. 30.00")), "{lines:#?}");
        observer.finished(&crate::files::example_result());
        drop(observer);
        let lines = screen.lines();
        assert!(!lines.iter().any(|line| line.contains("/4 [")), "{lines:#?}");
        assert!(lines.iter().any(|line| line.starts_with("F/F0 ")), "{lines:#?}");
    }

    #[test]
    fn a_run_that_fails_leaves_no_bar() {
        let screen = Screen::default();
        let mut observer = bar(&screen);
        observer.phase("setting up");
        assert!(screen.lines().concat().contains("setting up"));
        drop(observer);
        assert!(!screen.lines().concat().contains("setting up"), "{:?}", screen.lines());
    }

    #[test]
    fn a_cleared_bar_does_not_come_back() {
        let screen = Screen::default();
        let mut observer = bar(&screen);
        observer.started(&started(&Optimizer::default()));
        observer.bar.finish_and_clear();
        observer.stage(Stage::State);
        observer.evaluation(&evaluation(0));
        observer.phase("verifying");
        let lines = screen.lines();
        let text = lines.concat();
        assert!(!text.contains('[') && !text.contains("verifying"), "{lines:#?}");
        assert!(text.contains("5.00 .. 30.00"), "{lines:#?}");
    }

    #[test]
    fn the_line_fits_on_a_narrow_terminal() {
        let screen = Screen::default();
        let mut observer = bar(&screen);
        observer.started(&started(&Optimizer { max_evaluations: 100_000, ..Optimizer::default() }));
        observer.evaluation(&Evaluation { ratio: 12.5, seconds: 9e9, ..evaluation(99_998) });
        observer.stage(Stage::Elasticity);
        let lines = screen.lines();
        let last = lines.last().expect("a bar");
        assert!(last.contains("99999/100000") && last.contains("ETA 285y"), "{lines:#?}");
        assert!(last.chars().count() <= 80, "{lines:#?}");
    }
}
