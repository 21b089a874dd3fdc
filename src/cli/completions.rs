//! `nephroid completions`: what shells and `man` need to know.

use super::terminal::print_bytes;
use clap::{Args, Command, ValueEnum};
use clap_complete::Shell;
use nephroid::Result;
use nephroid::output::cannot_write;
use std::path::Path;

/// Print a completion script for a shell, or the man page
///
/// For bash: nephroid completions bash > /etc/bash_completion.d/nephroid
#[derive(Args)]
pub struct Arguments {
    #[arg(value_enum)]
    kind: Kind,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Kind {
    Bash,
    Elvish,
    Fish,
    Powershell,
    Zsh,
    /// The man page, in roff
    Man,
}

/// `command` is the whole program's.
pub fn run(arguments: &Arguments, mut command: Command) -> Result<()> {
    let shell = match arguments.kind {
        Kind::Bash => Shell::Bash,
        Kind::Elvish => Shell::Elvish,
        Kind::Fish => Shell::Fish,
        Kind::Powershell => Shell::PowerShell,
        Kind::Zsh => Shell::Zsh,
        Kind::Man => return man_page(command),
    };
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut command, "nephroid", &mut script);
    print_bytes(&script)
}

/// One page with a section for every command.
fn man_page(mut command: Command) -> Result<()> {
    let mut page = Vec::new();
    command.build();
    let mut render = || -> std::io::Result<()> {
        clap_mangen::Man::new(command.clone()).render(&mut page)?;
        for subcommand in command.get_subcommands().filter(|c| c.get_name() != "help") {
            let man = clap_mangen::Man::new(subcommand.clone());
            let mut part = Vec::new();
            man.render_synopsis_section(&mut part)?;
            man.render_description_section(&mut part)?;
            man.render_options_section(&mut part)?;
            let part = String::from_utf8_lossy(&part);
            let name = subcommand.get_name().to_uppercase();
            page.extend(
                part.replacen(".SH SYNOPSIS", &format!(".SH {name}"), 1)
                    .bytes(),
            );
        }
        Ok(())
    };
    render().map_err(|error| cannot_write(Path::new("stdout"), &error))?;
    print_bytes(&page)
}
