//! A bar on a terminal: the last line shows where the work is, finished evaluations stand above it.
//!
//! The only module that names indicatif. There is one terminal, so there is one bar: [`take_down`] removes it from any
//! thread, for messages of signals and panics.

use std::io::{IsTerminal, Write};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle, WeakProgressBar};

use super::console::announced;
use super::summary::{self, Named};
use super::table::{self, Columns};
use super::{Colour, Evaluation, Observer, Paint, RunObserver, Started, show};
use crate::output::RunResult;
use fluxmorph_optimizer::problem::Stage;

/// How often times on the bar move on.
const TICK: Duration = Duration::from_millis(200);

/// Steps of the bar.
const STEPS: usize = 10;

/// The bar on the terminal.
static SHOWN: Mutex<Option<WeakProgressBar>> = Mutex::new(None);

/// Takes the bar off the terminal, for good. Whoever shows it goes on in plain lines.
pub fn take_down() {
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
    paint: Paint,
    named: Named,
    header_is_shown: bool,
    shown: Arc<Mutex<Shown>>,
}

/// What the bar says beside its length; drawn by a thread of its own.
#[derive(Debug, Default)]
struct Shown {
    /// Of a run: limits on evaluations and time [s].
    limits: Option<(usize, Option<f64>)>,
    began: Option<Instant>,
    /// Evaluations done, and the time that those took which were computed now [s].
    evaluations: usize,
    timed: usize,
    seconds: f64,
    last: Option<Instant>,
    ratio: Option<f64>,
    worst_quality: Option<f64>,
    /// Work beside the evaluations: it stands alone.
    phase: Option<(String, Instant)>,
    stage: Option<(Stage, Instant)>,
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
            bar.paint = Paint::for_stderr();
            bar.bar.enable_steady_tick(TICK);
            *SHOWN.lock().unwrap_or_else(PoisonError::into_inner) = Some(bar.bar.downgrade());
            bar
        })
    }
}

impl<W: Write> Bar<W> {
    /// On any target; `writer` leads to the same place.
    pub fn new(target: ProgressDrawTarget, writer: W) -> Self {
        let shown = Arc::new(Mutex::new(Shown::default()));
        let bar = ProgressBar::with_draw_target(None, target);
        let told = Arc::clone(&shown);
        let style = ProgressStyle::with_template("{spinner} {status}")
            .expect("the template is a constant")
            .tick_chars("|/-\\ ")
            .with_key("status", move |_: &ProgressState, out: &mut dyn std::fmt::Write| {
                let shown = told.lock().unwrap_or_else(PoisonError::into_inner);
                let _ = out.write_str(&shown.status(Instant::now()));
            });
        bar.set_style(style);
        Self { bar, writer, paint: Paint::PLAIN, named: Named::default(), header_is_shown: false, shown }
    }

    /// Changes what the bar says, and draws it.
    fn tell(&self, change: impl FnOnce(&mut Shown)) {
        change(&mut self.shown.lock().unwrap_or_else(PoisonError::into_inner));
        if !self.bar.is_finished() {
            self.bar.tick();
        }
    }
}

impl Shown {
    /// The line without its spinner, within 78 columns.
    fn status(&self, now: Instant) -> String {
        let since = |began: Instant| {
            let seconds = now.saturating_duration_since(began).as_secs_f64();
            // Of what is short, a time would only flicker.
            if seconds >= 1.0 { format!(" {}", duration(seconds)) } else { String::new() }
        };
        if let Some((phase, began)) = &self.phase {
            return format!("{phase:.60}{}", since(*began));
        }
        let mut text = String::new();
        if let Some((limit, _)) = self.limits {
            let steps = (STEPS * self.evaluations).checked_div(limit).unwrap_or(0).min(STEPS);
            text += &format!("{}/{limit} [{:<STEPS$}]", self.evaluations, "=".repeat(steps));
            if let Some(ratio) = self.ratio {
                text += &format!(" F/F0 {ratio:.4}");
            }
            if let Some(quality) = self.worst_quality {
                text += &format!("  quality {quality:.3}");
            }
            if let Some(left) = self.left(now) {
                text += &format!("  ETA {}", duration(left));
            }
            text += "  ";
        }
        if let Some((stage, began)) = &self.stage {
            text += stage.describe();
            text += &since(*began);
        }
        text.chars().take(76).collect()
    }

    /// The longest time that the evaluations may still take [s]: the run may converge before.
    fn left(&self, now: Instant) -> Option<f64> {
        let (limit, time) = self.limits?;
        let elapsed = |since: Option<Instant>| since.map(|t| now.saturating_duration_since(t).as_secs_f64());
        let each = (self.timed > 0).then(|| self.seconds / self.timed as f64);
        let by_evaluations = each.map(|each| {
            (each * limit.saturating_sub(self.evaluations) as f64 - elapsed(self.last).unwrap_or(0.0))
                .max(0.0)
        });
        let by_time = time.zip(elapsed(self.began)).map(|(time, gone)| (time - gone).max(0.0));
        match (by_evaluations, by_time) {
            (Some(a), Some(b)) => Some(a.min(b)),
            (a, b) => a.or(b),
        }
    }
}

/// A time in a few characters.
fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 100.0 => format!("{s:.0} s"),
        s if s < 6000.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}

impl<W: Write> Observer for Bar<W> {
    // Above the bar.
    fn line(&mut self, text: &str) {
        let Self { bar, writer, .. } = self;
        if bar.is_finished() {
            show(writer, text);
        } else {
            bar.suspend(|| show(writer, text));
        }
    }

    fn phase(&mut self, name: &str) {
        self.tell(|shown| shown.phase = Some((name.to_owned(), Instant::now())));
    }

    fn stage(&mut self, stage: Stage) {
        self.tell(|shown| (shown.phase, shown.stage) = (None, Some((stage, Instant::now()))));
    }

    fn evaluation(&mut self, row: &Evaluation) {
        if !self.header_is_shown {
            self.header_is_shown = true;
            let header = self.paint.paint(Colour::Faint, &table::header(row, Columns::Compact));
            self.line(&header);
        }
        self.line(&table::row(row, Columns::Compact));
        self.tell(|shown| {
            let now = Instant::now();
            // An evaluation that is replayed from a journal takes no time now.
            let since = shown.last.or(shown.began).map_or(0.0, |last| (now - last).as_secs_f64());
            if since > 0.5 * row.seconds {
                shown.timed += 1;
                shown.seconds += row.seconds;
            }
            (shown.evaluations, shown.last) = (row.evaluation + 1, Some(now));
            (shown.ratio, shown.worst_quality) = (Some(row.ratio), Some(row.worst_quality));
        });
    }

    fn warning(&mut self, message: &str) {
        let text = self.paint.warning(message);
        self.line(&text);
    }
}

impl<W: Write> RunObserver for Bar<W> {
    fn started(&mut self, started: &Started<'_>) {
        let mut lines = announced(started);
        lines[0] = self.paint.paint(Colour::Strong, &lines[0]);
        lines.iter().for_each(|line| self.line(line));
        self.named = Named::of(started);
        let limits = started.optimizer.map(|optimizer| (optimizer.max_evaluations, optimizer.max_time));
        self.tell(|shown| (shown.limits, shown.began) = (limits, Some(Instant::now())));
    }

    fn finished(&mut self, result: &RunResult) {
        self.bar.finish_and_clear();
        self.line("");
        summary::lines(result, &self.named, self.paint).iter().for_each(|line| self.line(line));
    }
}

impl<W> Drop for Bar<W> {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

#[cfg(test)]
mod tests {
    use indicatif::TermLike;

    use super::super::tests::evaluation;
    use super::*;
    use crate::config::Optimizer;

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
            variables: 91,
            nodes: 100,
            tets: 400,
            unknowns: 350,
            directory: None,
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
        for part in ["1/4 [==        ]", "F/F0 0.5100", "quality 0.100", "adjoint"] {
            assert!(last.contains(part), "{part}: {lines:#?}");
        }
        assert_eq!(lines.iter().filter(|line| line.contains("/4 [")).count(), 1, "{lines:#?}");
        assert_eq!(lines[0], "Plate");
        assert!(lines.iter().any(|line| line.contains("5.00 .. 30.00")), "{lines:#?}");
        observer.finished(&crate::output::example_result());
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
    fn the_time_left_is_the_lesser_of_both_limits() {
        let now = Instant::now();
        let mut shown = Shown {
            limits: Some((10, None)),
            began: Some(now),
            evaluations: 4,
            timed: 4,
            seconds: 8.0,
            last: Some(now),
            ..Shown::default()
        };
        assert_eq!(shown.left(now), Some(12.0));
        shown.limits = Some((10, Some(5.0)));
        assert_eq!(shown.left(now + Duration::from_secs(1)), Some(4.0));
        assert!(shown.status(now).contains("ETA 5 s"), "{}", shown.status(now));
        let times = [5.0, 150.0, 9000.0].map(duration);
        assert_eq!(times, ["5 s", "2 min", "2.5 h"]);
    }

    #[test]
    fn the_line_fits_on_a_narrow_terminal() {
        let now = Instant::now();
        let shown = Shown {
            limits: Some((1_000_000, Some(1e9))),
            evaluations: 999_999,
            timed: 1,
            seconds: 1e4,
            ratio: Some(1e6),
            worst_quality: Some(0.1),
            stage: Some((Stage::Elasticity, now)),
            ..Shown::default()
        };
        assert!(shown.status(now).chars().count() <= 78);
    }
}
