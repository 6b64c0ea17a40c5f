//! `algorithm.rs` and `bobyqa.rs` of the optimizer with their tests, by links to where they are: all that stands between
//! Rust and NLopt.
//!
//! The whole program under a sanitizer takes a quarter of an hour to build, nearly all of it for code that never meets
//! NLopt; this takes a minute.

#![allow(dead_code, missing_docs)]

mod algorithm;
mod bobyqa;

/// What the two files take from the configuration.
mod config {
    /// The methods, as in `config::optimizer`: `algorithm.rs` does not compile with others.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Algorithm {
        Mma,
        Ccsaq,
        Slsqp,
        Lbfgs,
        Tnewton,
        Var2,
    }

    impl Algorithm {
        pub const ALL: [Self; 6] =
            [Self::Mma, Self::Ccsaq, Self::Slsqp, Self::Lbfgs, Self::Tnewton, Self::Var2];
    }
}

/// What they take from the errors.
mod error {
    use crate::cli::ExitCode;

    /// The errors of an optimisation, as in `error`.
    #[derive(Debug, thiserror::Error)]
    pub enum Error {
        #[error("{what} is {value:e}: {expected}")]
        NotFinite { what: String, value: f64, expected: &'static str },
        #[error("the optimisation failed: {cause}")]
        Optimisation { cause: &'static str },
    }

    impl Error {
        pub fn exit_code(&self) -> ExitCode {
            ExitCode::Numerical
        }
    }
}

/// What their tests take from the command line.
mod cli {
    /// The exit code of those errors.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum ExitCode {
        Numerical,
    }
}
