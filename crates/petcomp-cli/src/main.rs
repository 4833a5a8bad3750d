//! The program `petcomp`.

fn main() -> std::process::ExitCode {
    limit_heap_arenas();
    petcomp_cli::run(std::env::args_os()).into()
}

/// By default glibc makes eight heaps for each core and keeps in each what threads have freed: a
/// sixth of the memory of `dataset generate -j 8`. Four take no longer.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
#[expect(
    unsafe_code,
    reason = "a function of C, which takes two numbers; no other thread has begun"
)]
fn limit_heap_arenas() {
    const MAX_ARENAS: i32 = 4;
    // SAFETY: sound for any numbers.
    unsafe { libc::mallopt(libc::M_ARENA_MAX, MAX_ARENAS) };
}

#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
fn limit_heap_arenas() {}
