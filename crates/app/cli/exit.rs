//! Exit codes, as documented in the help.

use fluxmorph_optimizer::driver::StopReason;

use crate::output::RunStatus;

/// How the process ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum ExitCode {
    /// Converged, or done.
    Success = 0,
    /// Stopped at a limit; the results are valid.
    Stopped = 1,
    /// Wrong command line.
    Usage = 2,
    /// Wrong configuration or mesh.
    Configuration = 3,
    /// Numerical failure.
    Numerical = 4,
    /// Input or output failure.
    Files = 5,
    /// Interrupted (SIGINT); the state is saved.
    Interrupted = 130,
    /// Terminated (SIGTERM); the state is saved.
    Terminated = 143,
}

impl From<StopReason> for ExitCode {
    fn from(reason: StopReason) -> Self {
        match RunStatus::from(reason) {
            RunStatus::Converged | RunStatus::Done => Self::Success,
            RunStatus::Interrupted => Self::Interrupted,
            RunStatus::Failed => Self::Numerical,
            _ => Self::Stopped,
        }
    }
}

impl From<ExitCode> for std::process::ExitCode {
    fn from(code: ExitCode) -> Self {
        Self::from(code as u8)
    }
}

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
    use super::*;

    #[test]
    fn the_help_lists_every_code() {
        use ExitCode::*;
        for code in [Success, Stopped, Usage, Configuration, Numerical, Files, Interrupted, Terminated] {
            let number = format!("  {:<5}", code as u8);
            assert!(HELP.lines().any(|line| line.starts_with(&number)), "{code:?}");
        }
    }
}
