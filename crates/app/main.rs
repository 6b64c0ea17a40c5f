//! The program `fluxmorph`.

fn main() -> std::process::ExitCode {
    fluxmorph::cli::main()
}
