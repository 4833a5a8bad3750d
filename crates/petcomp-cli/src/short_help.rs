//! Help of the subcommands: the global options in one line.

/// Heading under which the global options are listed in full.
pub(crate) const GLOBAL_HEADING: &str = "Global options";

/// The same program, with its global options on one line at the end of every subcommand's help.
pub(crate) fn with_short_help(program: clap::Command) -> clap::Command {
    let options = program.get_arguments().filter(|arg| arg.is_global_set());
    let options: Vec<clap::Arg> = options.cloned().collect();
    let line = flags_line(&options);
    program.mut_subcommands(|command| with_hidden_options(command, &options, &line))
}

fn flags_line(options: &[clap::Arg]) -> String {
    let flags: Vec<String> = options.iter().map(shortest_flag).collect();
    let flags = flags.join(", ");
    format!("{GLOBAL_HEADING} (see `petcomp --help`): {flags}")
}

/// The options are present and hidden, so clap does not copy them from the program.
fn with_hidden_options(command: clap::Command, options: &[clap::Arg], line: &str) -> clap::Command {
    let hidden = options.iter().map(|arg| arg.clone().hide(true));
    command
        .args(hidden)
        .after_help(line.to_owned())
        .mut_subcommands(|inner| with_hidden_options(inner, options, line))
}

/// `-j` or, without a short form, `--limit`.
fn shortest_flag(arg: &clap::Arg) -> String {
    match (arg.get_short(), arg.get_long()) {
        (Some(letter), _) => format!("-{letter}"),
        (None, Some(name)) => format!("--{name}"),
        (None, None) => String::new(),
    }
}
