//! The database of runs: one SQLite file with runs, studies, and the analyses of designs.
//!
//! | file | content |
//! |---|---|
//! | `schema.sql` | tables and columns, which users may read with any other program |
//! | `mod` | opening, versions, errors |
//! | `records` | runs and studies that are taken from folders, and their list |
//! | `analyses` | analyses of earlier runs, with which an optimization starts warm |
//!
//! Any number of processes may write: each change is one transaction, and waits for the others. Everything but the
//! analyses is stored in folders, from which a lost database can be rebuilt.

mod analyses;
mod records;

pub use analyses::WarmStart;
pub use records::{ImportCounts, entries, take};

use anyhow::{Context, anyhow, bail};
use rusqlite::{Connection, ErrorCode, OpenFlags, Transaction, TransactionBehavior};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Identifies the files of linkwright among those of SQLite: "lwdb".
const APPLICATION: i32 = 0x6c77_6462;
/// Version of the tables.
const VERSION: i32 = 1;
/// Longest time that a change waits for other processes.
const BUSY_TIMEOUT: Duration = Duration::from_secs(60);

/// An open database.
pub struct Database {
    connection: Connection,
    path: PathBuf,
}

impl Database {
    /// Opens a database, and creates it if the file is missing or empty.
    pub fn open(path: &Path) -> anyhow::Result<Self> {
        let flags = OpenFlags::SQLITE_OPEN_READ_WRITE | OpenFlags::SQLITE_OPEN_CREATE | OpenFlags::SQLITE_OPEN_NO_MUTEX;
        let connection = Connection::open_with_flags(path, flags).map_err(|why| explained(path, &why))?;
        let mut opened = Self { connection, path: path.to_owned() };
        opened.prepare().map_err(|why| why.downcast().map_or_else(|why| why, |why| explained(path, &why)))?;
        Ok(opened)
    }

    /// Checks whose file it is, and makes the tables of an empty one.
    fn prepare(&mut self) -> anyhow::Result<()> {
        self.connection.busy_timeout(BUSY_TIMEOUT)?;
        self.connection.pragma_update(None, "synchronous", "NORMAL")?;
        let number = |name: &str| self.connection.pragma_query_value(None, name, |row| row.get::<_, i32>(0));
        let [mut application, mut version] = [number("application_id")?, number("user_version")?];
        if application == 0 {
            // Another process may make the tables at the same time: whoever comes second finds them.
            let change = self.connection.transaction_with_behavior(TransactionBehavior::Immediate)?;
            let tables: i64 = change.query_row("SELECT count(*) FROM sqlite_master", [], |row| row.get(0))?;
            if tables == 0 {
                change.execute_batch(include_str!("schema.sql"))?;
                change.pragma_update(None, "application_id", APPLICATION)?;
                change.pragma_update(None, "user_version", VERSION)?;
            }
            change.commit()?;
            let number = |name: &str| self.connection.pragma_query_value(None, name, |row| row.get::<_, i32>(0));
            [application, version] = [number("application_id")?, number("user_version")?];
        }
        let shown = self.path.display();
        if application != APPLICATION {
            bail!("{shown} is the database of another program; give another file");
        }
        if version != VERSION {
            bail!(
                "{shown} has version {version}, this program reads version {VERSION}; use the release that wrote it, or give another file"
            );
        }
        Ok(())
    }

    /// Makes a change in one transaction: completely or not at all.
    fn change<T>(&mut self, work: impl FnOnce(&Transaction<'_>) -> anyhow::Result<T>) -> anyhow::Result<T> {
        let path = &self.path;
        let explain = |why: rusqlite::Error| explained(path, &why);
        let change = self.connection.transaction_with_behavior(TransactionBehavior::Immediate).map_err(explain)?;
        let done = work(&change).map_err(|why| why.downcast().map_or_else(|why| why, explain))?;
        change.commit().map_err(explain)?;
        Ok(done)
    }
}

/// An error of SQLite with the name of the file and the remedy.
fn explained(path: &Path, why: &rusqlite::Error) -> anyhow::Error {
    let shown = path.display();
    let code = why.sqlite_error_code();
    let remedy = match code {
        Some(ErrorCode::NotADatabase) => return anyhow!("{shown} is not a database of linkwright; give another file"),
        Some(ErrorCode::DatabaseCorrupt) => {
            "it is damaged; the folders of runs and studies have everything except analyses: make a new database from them with \
             `linkwright runs FOLDER --db NEW`"
        }
        Some(ErrorCode::DiskFull) => "free disk space, then give the same command again; what was in it before is kept",
        Some(ErrorCode::DatabaseBusy | ErrorCode::DatabaseLocked) => {
            "another process has been writing for a minute; wait for its end, then give the same command again"
        }
        Some(ErrorCode::ReadOnly | ErrorCode::CannotOpen | ErrorCode::PermissionDenied) => {
            "give a file in a folder that exists and can be written to"
        }
        _ => "if it was changed by another program, make a new one with `linkwright runs FOLDER --db NEW`",
    };
    anyhow!("cannot use the database {shown}: {why}; {remedy}")
}

/// The absolute path of a folder, for the tables.
fn absolute(folder: &Path) -> anyhow::Result<String> {
    let path = std::fs::canonicalize(folder).with_context(|| format!("cannot find {}", folder.display()))?;
    Ok(path.display().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(name: &str) -> PathBuf {
        let path = std::env::temp_dir().join(format!("linkwright-{name}-{}.db", std::process::id()));
        drop(std::fs::remove_file(&path));
        path
    }

    fn message(path: &Path) -> String {
        Database::open(path).map(|_| ()).expect_err("the file is no database of this version").to_string()
    }

    #[test]
    fn other_files_are_rejected_and_stay_as_they_are() {
        let path = file("other");
        std::fs::write(&path, "version = 2\n".repeat(100)).unwrap();
        assert!(message(&path).contains("is not a database of linkwright"));
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "version = 2\n".repeat(100));
        std::fs::remove_file(&path).unwrap();
        Connection::open(&path).unwrap().execute_batch("CREATE TABLE people (name TEXT)").unwrap();
        let before = std::fs::read(&path).unwrap();
        assert!(message(&path).contains("is the database of another program"));
        assert_eq!(std::fs::read(&path).unwrap(), before);
        std::fs::remove_file(&path).unwrap();
        drop(Database::open(&path).unwrap());
        Connection::open(&path).unwrap().pragma_update(None, "user_version", VERSION + 1).unwrap();
        assert!(message(&path).contains("has version 2, this program reads version 1"));
        std::fs::remove_file(&path).unwrap();
        assert!(message(&path.join("no/such/folder")).contains("in a folder that exists"));
    }

    #[test]
    fn processes_that_open_an_empty_file_at_the_same_time_share_it() {
        let path = file("shared");
        std::thread::scope(|scope| {
            let open = || Database::open(&path).map(drop).unwrap();
            let all: Vec<_> = (0..8).map(|_| scope.spawn(open)).collect();
            all.into_iter().for_each(|thread| thread.join().unwrap());
        });
        std::fs::remove_file(&path).unwrap();
    }

    #[test]
    fn a_change_that_fails_leaves_nothing() {
        let path = file("change");
        let mut database = Database::open(&path).unwrap();
        let failed: anyhow::Result<()> = database.change(|change| {
            change.execute("INSERT INTO runs (folder, begun, entry, text) VALUES ('a', 'b', '{}', '')", [])?;
            bail!("on request")
        });
        assert_eq!(failed.unwrap_err().to_string(), "on request");
        let count: i64 = database.connection.query_row("SELECT count(*) FROM runs", [], |row| row.get(0)).unwrap();
        assert_eq!(count, 0);
        std::fs::remove_file(&path).unwrap();
    }
}
