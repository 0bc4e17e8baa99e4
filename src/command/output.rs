//! Standard output, files of results, dates and durations.

use anyhow::Context;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Duration;
use time::OffsetDateTime;
use time::format_description::well_known::Rfc3339;

/// Prints a line on standard output; ends the program quietly if the reader has closed the pipe.
pub fn say(text: &str) -> anyhow::Result<()> {
    match writeln!(std::io::stdout(), "{text}") {
        Err(e) if e.kind() == std::io::ErrorKind::BrokenPipe => std::process::exit(0),
        result => result.context("cannot write to standard output"),
    }
}

/// Creates a folder and its parents.
pub fn create_folder(path: &Path) -> anyhow::Result<()> {
    std::fs::create_dir_all(path).with_context(|| format!("cannot make the folder {}", path.display()))
}

/// Writes a file.
pub fn write(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    std::fs::write(path, bytes).with_context(|| format!("cannot write {}", path.display()))
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
