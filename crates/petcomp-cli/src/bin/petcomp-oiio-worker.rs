//! The worker that reads what only OpenImageIO can; petcomp starts it, users do not.

fn main() -> std::process::ExitCode {
    petcomp::io::serve_worker(std::env::args_os().skip(1))
}
