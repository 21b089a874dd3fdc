//! `nephroid view` in a build without a window.

use clap::Args;
use nephroid::{Error, Result};
use std::ffi::OsString;

/// Open a window on a scene (needs the feature `viewer`)
#[derive(Args)]
pub struct Arguments {
    /// Not used by this build
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, hide = true)]
    _arguments: Vec<OsString>,
}

pub fn run(_: &Arguments) -> Result<()> {
    Err(Error::Usage {
        reason: "this build of nephroid opens no window".into(),
        remedy: "build it with `cargo build --release --features viewer`, or run `make view`"
            .into(),
    })
}
