//! What the worker program gives up before it processes a file: it receives and returns bytes, so
//! it needs nothing else.
//!
//! Anything that the system does not support is reported, and the worker continues with the rest.

use crate::io::limits::Limits;
use rustix::process::{Resource, Rlimit, setrlimit};

/// Address space beyond what is mapped at the start and what a file may demand: the decoders' own
/// needs.
const HEADROOM_BYTES: u64 = 256 << 20;
/// Copies of a picture that exist at a time: in the decoder, as returned, and cropped to its window.
const PICTURE_COPIES: u64 = 3;
/// CPU time of one worker, seconds: a regular one is replaced after this, one in an endless loop
/// was killed long before.
const CPU_SECONDS: u64 = 600;
/// Maximum number of open files; it opens none itself.
const MAX_OPEN_FILES: u64 = 64;

/// Limits on this process's memory, as tight as the current file allows.
#[derive(Clone, Copy, Debug)]
pub(super) struct MemoryLimit {
    /// Mapped after the program had loaded its libraries.
    at_start: u64,
    most: u64,
}

impl MemoryLimit {
    /// Fixes the maximum for these limits.
    pub(super) fn new(limits: &Limits) -> Self {
        let at_start = mapped_bytes().unwrap_or(ASSUMED_MAPPED_BYTES);
        let most = needed_bytes(at_start, limits.file_bytes, limits.decoded_bytes);
        Self { at_start, most }
    }

    /// Allows the memory for a file of this size with this many decoded bytes.
    pub(super) fn allow(&self, file_bytes: u64, decoded_bytes: u64) {
        let current = needed_bytes(self.at_start, file_bytes, decoded_bytes).min(self.most);
        limit_resource(Resource::As, current, self.most);
    }
}

/// Address space that a worker needs for a file, given what it had mapped at its start.
fn needed_bytes(at_start: u64, file_bytes: u64, decoded_bytes: u64) -> u64 {
    let pictures = decoded_bytes.saturating_mul(PICTURE_COPIES);
    [HEADROOM_BYTES, pictures, file_bytes]
        .into_iter()
        .fold(at_start, u64::saturating_add)
}

/// Used if the system does not report it: what OpenImageIO 2.4 maps on Debian 12.
const ASSUMED_MAPPED_BYTES: u64 = 768 << 20;

/// Address space in use, as reported by the system.
fn mapped_bytes() -> Option<u64> {
    let pages: u64 = std::fs::read_to_string("/proc/self/statm")
        .ok()?
        .split(' ')
        .next()?
        .parse()
        .ok()?;
    pages.checked_mul(rustix::param::page_size() as u64)
}

fn limit_resource(resource: Resource, current: u64, maximum: u64) {
    // Lowering its own limits is always allowed for a process; a system without one of them does
    // not have the corresponding risk either.
    let _ = setrlimit(
        resource,
        Rlimit {
            current: Some(current),
            maximum: Some(maximum),
        },
    );
}

/// Gives up everything except memory, the open streams, and some CPU time. Returns what the system
/// does not support.
pub(super) fn enter_sandbox(limits: &Limits) -> (MemoryLimit, Vec<String>) {
    let memory = MemoryLimit::new(limits);
    memory.allow(0, 0);
    limit_resource(Resource::Cpu, CPU_SECONDS, CPU_SECONDS);
    limit_resource(Resource::Fsize, 0, 0);
    limit_resource(Resource::Core, 0, 0);
    limit_resource(Resource::Nofile, MAX_OPEN_FILES, MAX_OPEN_FILES);
    #[cfg(target_os = "linux")]
    let missing = linux::restrict();
    #[cfg(not(target_os = "linux"))]
    let missing = vec!["Landlock and seccomp: not this system".into()];
    (memory, missing)
}

#[cfg(target_os = "linux")]
mod linux {
    use landlock::{ABI, Access, AccessFs, AccessNet, Ruleset, RulesetAttr, RulesetStatus, Scope};
    use seccompiler::{
        BpfProgram, SeccompAction, SeccompCmpArgLen, SeccompCmpOp, SeccompCondition, SeccompFilter,
        SeccompRule,
    };
    use std::collections::BTreeMap;

    pub(super) fn restrict() -> Vec<String> {
        let steps = [
            ("no_new_privs", set_no_new_privileges()),
            ("Landlock", forbid_files()),
            ("seccomp", filter_calls()),
        ];
        steps
            .into_iter()
            .filter_map(|(name, done)| done.err().map(|e| format!("{name}: {e}")))
            .collect()
    }

    type Outcome = Result<(), Box<dyn std::error::Error>>;

    fn set_no_new_privileges() -> Outcome {
        Ok(rustix::thread::set_no_new_privs(true)?)
    }

    /// Forbids opening files and folders, connecting sockets and signalling other processes: a rule
    /// set without rules.
    fn forbid_files() -> Outcome {
        // Features that the kernel does not support are left out.
        let abi = ABI::V6;
        let rules = Ruleset::default()
            .handle_access(AccessFs::from_all(abi))?
            .handle_access(AccessNet::from_all(abi))?
            .scope(Scope::from_all(abi))?;
        match rules.create()?.restrict_self()?.ruleset {
            RulesetStatus::NotEnforced => Err("not in this kernel".into()),
            _ => Ok(()),
        }
    }

    /// The calls of a decoder that opens nothing: for its own memory, its streams, the clock, and
    /// its exit. Also those that a thread makes before its first line (`rseq`, `set_robust_list`):
    /// libraries start their threads when they are loaded, and on a busy machine these may not have
    /// run yet when the filter takes effect; the C library ends the process if `rseq` is refused.
    const ALLOWED_CALLS: [i64; 36] = [
        libc::SYS_read,
        libc::SYS_readv,
        libc::SYS_write,
        libc::SYS_writev,
        libc::SYS_close,
        libc::SYS_lseek,
        libc::SYS_fstat,
        libc::SYS_fcntl,
        libc::SYS_ppoll,
        libc::SYS_brk,
        libc::SYS_mmap,
        libc::SYS_munmap,
        libc::SYS_mprotect,
        libc::SYS_mremap,
        libc::SYS_madvise,
        libc::SYS_futex,
        libc::SYS_rseq,
        libc::SYS_set_robust_list,
        libc::SYS_rt_sigaction,
        libc::SYS_rt_sigprocmask,
        libc::SYS_rt_sigreturn,
        libc::SYS_sigaltstack,
        libc::SYS_sched_yield,
        libc::SYS_sched_getaffinity,
        libc::SYS_nanosleep,
        libc::SYS_clock_nanosleep,
        libc::SYS_clock_gettime,
        libc::SYS_clock_getres,
        libc::SYS_gettimeofday,
        libc::SYS_getrandom,
        libc::SYS_getpid,
        libc::SYS_gettid,
        libc::SYS_getrusage,
        libc::SYS_restart_syscall,
        libc::SYS_exit,
        libc::SYS_exit_group,
    ];

    fn filter_calls() -> Outcome {
        allow_only(call_rules()?)
    }

    /// Every other call fails with EPERM, including all that open, execute, connect, trace and
    /// start.
    fn allow_only(rules: BTreeMap<i64, Vec<SeccompRule>>) -> Outcome {
        // The stricter of the two filters applies: `clone3` is unknown.
        apply_filter(
            BTreeMap::from([(libc::SYS_clone3, Vec::new())]),
            SeccompAction::Allow,
            SeccompAction::Errno(libc::ENOSYS as u32),
        )?;
        apply_filter(
            rules,
            SeccompAction::Errno(libc::EPERM as u32),
            SeccompAction::Allow,
        )
    }

    fn apply_filter(
        rules: BTreeMap<i64, Vec<SeccompRule>>,
        otherwise: SeccompAction,
        matched: SeccompAction,
    ) -> Outcome {
        let arch = std::env::consts::ARCH.try_into()?;
        let filter = SeccompFilter::new(rules, otherwise, matched, arch)?;
        let program: BpfProgram = filter.try_into()?;
        // OpenImageIO's libraries have already started threads.
        Ok(seccompiler::apply_filter_all_threads(&program)?)
    }

    fn call_rules() -> Result<BTreeMap<i64, Vec<SeccompRule>>, seccompiler::BackendError> {
        let allowed = ALLOWED_CALLS.into_iter();
        let mut rules: BTreeMap<_, _> = allowed.map(|call| (call, Vec::new())).collect();
        // Its own limits, and a signal to itself (abort), are allowed.
        let own = first_argument_is(std::process::id().into())?;
        rules.insert(libc::SYS_prlimit64, vec![first_argument_is(0)?]);
        rules.insert(libc::SYS_tgkill, vec![own]);
        // The HEIC decoder starts a thread for each tile. For `clone` a filter can see the flags
        // that make it a thread rather than a process; for `clone3` it cannot, and the C library
        // falls back to `clone` if `clone3` is unknown.
        rules.insert(libc::SYS_clone3, Vec::new());
        rules.insert(
            libc::SYS_clone,
            vec![first_argument_has(libc::CLONE_THREAD)?],
        );
        Ok(rules)
    }

    fn first_argument_is(value: u64) -> Result<SeccompRule, seccompiler::BackendError> {
        first_argument(SeccompCmpOp::Eq, value)
    }

    fn first_argument_has(flag: i32) -> Result<SeccompRule, seccompiler::BackendError> {
        let flag = flag as u64;
        first_argument(SeccompCmpOp::MaskedEq(flag), flag)
    }

    fn first_argument(
        op: SeccompCmpOp,
        value: u64,
    ) -> Result<SeccompRule, seccompiler::BackendError> {
        let condition = SeccompCondition::new(0, SeccompCmpArgLen::Dword, op, value)?;
        SeccompRule::new(vec![condition])
    }

    #[cfg(test)]
    mod tests {
        use super::*;
        use std::process::Command;

        /// Run by [`threads_start_and_processes_do_not`] in a separate process.
        #[test]
        #[ignore = "gives up what other tests need"]
        fn restricted() {
            // Programs may be run, and Landlock, which would refuse their files, is left out: only
            // a process to run them in is refused.
            let mut rules = call_rules().unwrap();
            rules.insert(libc::SYS_execve, Vec::new());
            set_no_new_privileges().unwrap();
            allow_only(rules).unwrap();
            assert_eq!(std::thread::spawn(|| 1).join().unwrap(), 1);
            let refused = Command::new("/bin/true").spawn().unwrap_err();
            assert_eq!(refused.raw_os_error(), Some(libc::EPERM));
        }

        #[test]
        fn threads_start_and_processes_do_not() {
            if !std::path::Path::new("/proc/sys/kernel/seccomp").exists() {
                return;
            }
            let name = "io::worker::sandbox::linux::tests::restricted";
            let child = Command::new(std::env::current_exe().unwrap())
                .args([name, "--exact", "--ignored"])
                .output()
                .unwrap();
            let said = String::from_utf8_lossy(&child.stdout);
            assert!(said.contains("1 passed"), "{said}");
        }
    }
}
