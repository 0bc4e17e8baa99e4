//! Standard output and standard error, digits of numbers, dates and durations.

use anyhow::Context;
use linkwright::model_file::visible;
use linkwright::report::number;
use std::io::{self, Write};
use std::path::PathBuf;
use std::time::Duration;
use time::OffsetDateTime;
use time::format_description::well_known::Rfc3339;

/// Prints a line on standard output; control characters are shown, not sent.
pub fn say(text: &str) -> anyhow::Result<()> {
    say_raw(&visible(text))
}

/// Prints a line on standard output as it is, for control sequences of our own.
pub fn say_raw(text: &str) -> anyhow::Result<()> {
    match writeln!(io::stdout(), "{text}") {
        Err(e) if e.kind() == io::ErrorKind::BrokenPipe => Err(ClosedOutput.into()),
        result => result.context("cannot write to standard output"),
    }
}

/// Prints a line on standard error; control characters are shown. A failure to write it is ignored.
pub fn complain(text: &str) {
    drop(writeln!(io::stderr(), "{}", visible(text)));
}

/// Prints the warnings of an analysis on standard error.
pub fn warn(warnings: &[String]) {
    for warning in warnings {
        complain(&format!("Warning: {warning}"));
    }
}

/// The number of significant digits on the terminal.
#[derive(clap::Args)]
pub struct Digits {
    /// Significant digits of the numbers
    #[arg(long, value_name = "N", default_value_t = number::DIGITS as u16, value_parser = clap::value_parser!(u16).range(1..=17))]
    pub digits: u16,
}

impl Digits {
    /// The number.
    pub fn count(&self) -> usize {
        usize::from(self.digits)
    }
}

/// The reader of standard output has closed it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClosedOutput;

impl std::fmt::Display for ClosedOutput {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("standard output was closed before the end")
    }
}

impl std::error::Error for ClosedOutput {}

/// An argument as it is typed into a shell: a file, a folder, or a value with its name.
pub fn argument(text: &str) -> String {
    // It would be read as an option.
    if text.starts_with('-') {
        return argument(&format!("./{text}"));
    }
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "_.-=/".contains(c);
    if text.chars().all(is_plain) { text.to_owned() } else { format!("'{}'", text.replace('\'', "'\\''")) }
}

/// The default folder of results: `out`, or the value of `LINKWRIGHT_OUT`.
pub fn results() -> PathBuf {
    let wanted = std::env::var_os("LINKWRIGHT_OUT").filter(|name| !name.is_empty());
    wanted.map_or_else(|| PathBuf::from("out"), PathBuf::from)
}

/// The current time in UTC, as in 2026-11-22T08:05:09Z.
pub fn now() -> anyhow::Result<String> {
    Ok(OffsetDateTime::now_utc().replace_nanosecond(0)?.format(&Rfc3339)?)
}

/// A duration in short form: 0.4 s, 12 s, 3 min 05 s, 2 h 07 min.
pub fn brief(time: Duration) -> String {
    let seconds = time.as_secs_f64();
    let pair = |whole: u64| (whole / 60, whole % 60);
    match seconds {
        s if s < 9.95 => format!("{s:.1} s"),
        s if s < 59.5 => format!("{s:.0} s"),
        s if s < 3570.0 => {
            let (minutes, seconds) = pair(s.round() as u64);
            format!("{minutes} min {seconds:02} s")
        }
        s => {
            let (hours, minutes) = pair((s / 60.0).round() as u64);
            format!("{hours} h {minutes:02} min")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_and_durations_are_brief() {
        let date = now().unwrap();
        assert!(date.len() == 20 && date.starts_with("20") && date.ends_with('Z'), "{date}");
        let shown = [0.04, 9.96, 59.7, 3600.0].map(|s| brief(Duration::from_secs_f64(s)));
        assert_eq!(shown, ["0.0 s", "10 s", "1 min 00 s", "1 h 00 min"]);
    }
}
