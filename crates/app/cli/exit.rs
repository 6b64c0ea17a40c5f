//! The exit codes in the help.

/// The codes for the end of the help text.
pub(super) const HELP: &str = "\
Exit codes:
  0    converged, or done
  1    stopped at a limit, the results are valid
  2    wrong command line
  3    wrong configuration or mesh
  4    numerical failure
  5    input or output failure
  130  interrupted, the state is saved
  143  terminated, the state is saved

Data goes to standard output, progress and messages to standard error. Colours are left out when NO_COLOR is set.";

#[cfg(test)]
mod tests {
    use super::HELP;
    use crate::exit_code::ExitCode;

    #[test]
    fn the_help_lists_every_code() {
        use ExitCode::*;
        for code in [Success, Stopped, Usage, Configuration, Numerical, Files, Interrupted, Terminated] {
            let number = format!("  {:<5}", code as u8);
            assert!(HELP.lines().any(|line| line.starts_with(&number)), "{code:?}");
        }
    }
}
