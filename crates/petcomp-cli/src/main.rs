//! The program `petcomp`.

fn main() -> std::process::ExitCode {
    petcomp_cli::run(std::env::args_os()).into()
}
