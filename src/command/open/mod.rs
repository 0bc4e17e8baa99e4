//! `linkwright open FILE`: the interactive design tool, a page in the browser that a server of this process answers.
//!
//! | file | subject |
//! |---|---|
//! | `server` | connections, routes and their limits |
//! | `guard` | which requests are answered: token, host, origin, headers of all answers |
//! | `session` | the model file, its unsaved edits, and what pages are told about them |
//! | `optimization` | a run that is watched and steered, in its folder |
//! | `steps` | the steps of a run, which a worker does |
//! | `stored` | trial steps of runs, stored runs and studies, as pages show them: cycles, rows, differences, notes |
//! | `queue` | requests for analyses: the newest of each page counts, a running one can be stopped |
//! | `process` | worker processes: how they are started, asked and stopped |
//! | `worker` | what a worker does: analyses and steps of runs, which can be stopped at any moment |
//! | `analysis` | the record of an analysed design with its motion and derivatives |
//! | `page/` | the page itself: HTML, style and scripts, without a build step and without a network |

mod analysis;
mod guard;
mod optimization;
mod process;
mod queue;
mod server;
mod session;
mod steps;
mod stored;
mod worker;

use super::budget::Budget;
use super::model::model_file;
use super::output::{complain, say};
use anyhow::Context;
use clap::Args;
use session::Session;
use std::path::PathBuf;
use std::process::{Command, Stdio};

#[derive(Args)]
#[command(after_help = "Examples:
  linkwright open lift.toml
  linkwright open lift --no-browser     prints the address

Answers on the loopback address of this computer only, at a random port, to pages that know the token in the address. Ctrl-C ends it;
edits that were not saved stay in FILE.unsaved.")]
pub struct Open {
    /// The model file; `lift` means lift.toml
    file: PathBuf,
    /// Print the address and open no browser
    #[arg(long)]
    no_browser: bool,
    /// Analyse designs that are read from standard input, for the server
    #[arg(long, hide = true)]
    worker: bool,
    #[command(flatten)]
    budget: Budget,
}

impl Open {
    pub fn run(&self) -> anyhow::Result<()> {
        if self.worker {
            return worker::run(self.budget);
        }
        let session = Session::open(&model_file(&self.file), self.budget)?;
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
        runtime.context("cannot start the server")?.block_on(async {
            let server = server::Server::bind(session).await?;
            say(&format!("Open {}", server.address()))?;
            if !self.no_browser && !show(&server.launch_address()) {
                complain("note: no browser could be started; open the address above in one");
            }
            server.run().await
        })
    }
}

/// Asks the system to show an address in the user's browser: `xdg-open`, `open` on macOS, `rundll32` on Windows. Returns `false` if the
/// program cannot be started.
fn show(address: &str) -> bool {
    let (program, arguments): (&str, &[&str]) = match () {
        () if cfg!(target_os = "macos") => ("open", &[]),
        () if cfg!(windows) => ("rundll32", &["url.dll,FileProtocolHandler"]),
        () => ("xdg-open", &[]),
    };
    let mut command = Command::new(program);
    command.args(arguments).arg(address).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command.spawn().is_ok()
}
