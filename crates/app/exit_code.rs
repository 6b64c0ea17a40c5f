//! How the process ends: the exit codes, as documented in the help.

use fluxmorph_optimizer::driver::StopReason;

use crate::files::RunStatus;

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
