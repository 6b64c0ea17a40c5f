//! The program `fluxmorph`.

fn main() -> std::process::ExitCode {
    fluxmorph_optimizer::cli::main()
}
