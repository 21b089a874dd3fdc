//! Output on the terminal: results to stdout, progress and the log to stderr.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressFinish, ProgressStyle};
use nephroid::Result;
use nephroid::output::cannot_write;
use std::io::{ErrorKind, Write};
use std::path::Path;

/// Text with control characters written out, of which names in scene files, meshes and JSON may have any: a
/// terminal would obey them. Lines stay lines.
pub fn escaped(text: &str) -> String {
    // Those that turn the direction of writing hide what is printed, too.
    let is_hidden = |c: char| matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    (text.chars())
        .flat_map(|c| {
            let escape = c != '\n' && (c.is_control() || is_hidden(c));
            let (escaped, plain) = if escape {
                (Some(c.escape_default()), None)
            } else {
                (None, Some(c))
            };
            escaped.into_iter().flatten().chain(plain)
        })
        .collect()
}

/// Prints a result.
///
/// # Errors
/// [`nephroid::Error::Output`] where stdout cannot be written; a reader that stopped listening is no error.
pub fn print(text: &str) -> Result<()> {
    write(&escaped(text))
}

/// Prints a result as JSON.
///
/// # Errors
/// As [`print`].
pub fn print_json(value: &impl serde::Serialize) -> Result<()> {
    write(&serde_json::to_string_pretty(value).expect("results have string keys"))
}

fn write(text: &str) -> Result<()> {
    print_bytes(format!("{text}\n").as_bytes())
}

/// Prints bytes as they are.
///
/// # Errors
/// As [`print`].
pub fn print_bytes(bytes: &[u8]) -> Result<()> {
    let mut stdout = std::io::stdout().lock();
    match stdout.write_all(bytes).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(cannot_write(Path::new("stdout"), &error))
        }
        _ => Ok(()),
    }
}

/// Writes a line of some `kind`, as `warning`, to the log.
pub fn log(kind: &str, text: &str) {
    // There is nowhere to complain.
    let _ = writeln!(std::io::stderr(), "{kind}: {}", escaped(text));
}

/// Logs the first lines of a kind, and the number of further ones.
pub fn log_some(kind: &str, lines: &[String]) {
    const MOST: usize = 8;
    let shown = if lines.len() > MOST + 1 {
        MOST
    } else {
        lines.len()
    };
    for line in &lines[..shown] {
        log(kind, line);
    }
    if shown < lines.len() {
        log(kind, &format!("{} more like these", lines.len() - shown));
    }
}

/// A bar of `length` steps, on stderr, and only if that is a terminal.
pub fn progress_bar(length: u64) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(length), ProgressDrawTarget::stderr());
    let style = ProgressStyle::with_template("{wide_bar} {percent:>3} % {msg} {eta} left");
    bar.set_style(style.expect("the template is valid"));
    bar.with_finish(ProgressFinish::AndClear)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_terminal_obeys_is_written_out() {
        let text = "mesh \u{1b}]0;title\u{7}\u{1b}[2J\rü\n\u{9b}31m\u{202e}exe.";
        let escaped = escaped(text);
        assert_eq!(
            escaped,
            "mesh \\u{1b}]0;title\\u{7}\\u{1b}[2J\\rü\n\\u{9b}31m\\u{202e}exe."
        );
    }
}
