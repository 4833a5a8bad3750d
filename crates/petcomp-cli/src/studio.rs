//! `petcomp studio`: pages for the browser on this machine.

use crate::global::GlobalArgs;
use crate::interruption::on_interrupt;
use crate::print;
use petcomp_studio::Server;
use std::path::PathBuf;

#[derive(clap::Args)]
pub(crate) struct StudioArgs {
    /// Folder with photos, labels, assets, recipes and datasets; nothing outside it is read or
    /// written
    #[arg(value_name = "FOLDER", default_value = ".")]
    folder: PathBuf,
    /// Port on 127.0.0.1; 0 means any free port
    #[arg(long, value_name = "N", default_value_t = 0)]
    port: u16,
}

/// Prints the URL, and serves until Ctrl-C.
pub(crate) fn run(args: &StudioArgs, global: &GlobalArgs) -> anyhow::Result<()> {
    let server = Server::open(&args.folder, args.port)?;
    print::line(server.address());
    global.print_status("open this address in a browser on this machine; Ctrl-C stops the studio");
    let stop = server.stop();
    on_interrupt(move || stop.stop())?;
    server.run();
    Ok(())
}
