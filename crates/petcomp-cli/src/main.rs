//! The program `petcomp`.

#[cfg(all(target_os = "linux", target_env = "gnu"))]
mod heap;

fn main() -> std::process::ExitCode {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    heap::tune();
    petcomp_cli::run(std::env::args_os()).into()
}
