//! Programs that answer, fail, crash, hang and write invalid output: small shell scripts.

use super::{ExternalProgram, ProgramAnalysis, WithThreads};
use crate::problem::{Analysis, ResponseAt, Responses};
use crate::responses::Differences;
use error::{Error, Result};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// A temporary folder that is removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("linkwright-program-{name}-{}", std::process::id()));
        drop(std::fs::remove_dir_all(&path));
        std::fs::create_dir_all(&path).expect("the temporary folder can be written to");
        Self(path)
    }

    fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.0.join(name)).unwrap_or_default()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        drop(std::fs::remove_dir_all(&self.0));
    }
}

/// A script that runs `$work` for each request, with `$id` and the design variable `$x`.
fn script(work: &str) -> String {
    format!(
        r#"number() {{ printf '%s' "$line" | sed "s/.*\"$1\":\([-0-9.e]*\).*/\1/"; }}
while read -r line; do id=$(number id); x=$(number x); {work}
done"#
    )
}

/// r = (x², 2x²) at two time points and m = 3x.
const GOOD: &str = r#"echo "$line" >> requests
    awk -v id="$id" -v x="$x" 'BEGIN { printf "{\"id\":%d,\"responses\":{\"r\":[%.17g,%.17g],\"m\":%.17g}}\n", id, x*x, 2*x*x, 3*x }'"#;

fn program(folder: &Folder, script: &str) -> ExternalProgram {
    let limit = Duration::from_secs(20);
    ExternalProgram { folder: Some(folder.0.clone()), time_limit: limit, ..ExternalProgram::new(["sh", "-c", script]) }
}

fn analysis(program: ExternalProgram) -> ProgramAnalysis {
    ProgramAnalysis::new(program, ["x"], &[0.0, 1.0], [("r", true), ("m", false)]).expect("the names are good")
}

fn why(result: Result<Responses>) -> String {
    match result {
        Err(Error::Analysis { why, .. }) => why,
        other => panic!("a failed analysis was expected: {other:?}"),
    }
}

#[test]
fn a_program_answers_and_no_design_is_analysed_twice() {
    let folder = Folder::new("answers");
    let analysis = analysis(program(&folder, &script(GOOD)));
    for x in [0.5, 3.0, 0.5, 3.0] {
        assert_eq!(analysis.analyze(&[x]).unwrap().values, [vec![x * x, 2.0 * x * x], vec![3.0 * x]]);
    }
    assert_eq!(folder.read("requests").lines().count(), 2);
    // A further component of the design is not sent.
    assert_eq!(analysis.analyze(&[0.5, 9.0]).unwrap().values[1], [1.5]);
    assert_eq!(folder.read("requests").lines().count(), 2);
}

#[test]
fn its_derivatives_are_asked_for_once() {
    let folder = Folder::new("derivatives");
    let work = r#"echo "$line" >> requests
        awk -v id="$id" -v x="$x" 'BEGIN { printf "{\"id\":%d,\"responses\":{\"r\":[%.17g,1],\"m\":1},\"derivatives\":{\"r\":{\"x\":[%.17g,0]},\"m\":{\"x\":0}}}\n", id, x*x, 2*x }'"#;
    let analysis = analysis(program(&folder, &script(work)));
    let responses = analysis.analyze(&[1.5]).unwrap();
    let wanted = [ResponseAt { response: 1, point: 0 }, ResponseAt { response: 0, point: 0 }];
    for _ in 0..2 {
        let rows = analysis.sensitivities(&[1.5, 7.0], &responses, &wanted).unwrap();
        assert_eq!(rows.as_slice(), [0.0, 3.0, 0.0, 0.0]);
    }
    // They came with the first answer.
    assert_eq!(folder.read("requests").lines().count(), 1);
}

#[test]
fn values_and_derivatives_are_one_request() {
    let folder = Folder::new("together");
    // Derivatives as requested only.
    let work = r#"echo "$line" >> requests
        case "$line" in *'"derivatives":true'*) d=',"derivatives":{"r":{"x":[1,0]},"m":{"x":0}}';; *) d=;; esac
        printf '{"id":%d,"responses":{"r":[%s,1],"m":1}%s}\n' "$id" "$x" "$d""#;
    let analysis = analysis(program(&folder, &script(work))).with_derivatives();
    for x in [0.5, 3.0] {
        let responses = analysis.analyze(&[x]).unwrap();
        let rows = analysis.sensitivities(&[x], &responses, &[ResponseAt { response: 0, point: 0 }]).unwrap();
        assert_eq!((responses.values[0][0], rows[(0, 0)]), (x, 1.0));
    }
    assert_eq!(folder.read("requests").lines().count(), 2);
    // Values of many designs are all that is asked for.
    analysis.analyze_many(&[vec![0.5], vec![0.25]]);
    let requests = folder.read("requests");
    assert!(requests.lines().count() == 3 && requests.ends_with("\"derivatives\":false}\n"), "{requests}");
}

#[test]
fn a_program_without_derivatives_says_so() {
    let folder = Folder::new("none");
    let analysis = analysis(program(&folder, &script(GOOD)));
    let responses = analysis.analyze(&[1.0]).unwrap();
    let error = analysis.sensitivities(&[1.0], &responses, &[ResponseAt { response: 0, point: 0 }]).unwrap_err();
    assert!(error.to_string().contains("no `derivatives`; use finite differences"), "{error}");
}

#[test]
fn differences_use_several_processes_at_once() {
    let folder = Folder::new("jobs");
    let work = format!("echo $$ >> processes; sleep 0.2; {GOOD}");
    let program = ExternalProgram { jobs: 4, ..program(&folder, &script(&work)) };
    let names = ["x", "y", "z", "w"];
    let slow = ProgramAnalysis::new(program, names, &[0.0, 1.0], [("r", true), ("m", false)]).unwrap();
    let slow = WithThreads::new(Differences::forward(slow, 1e-3).unwrap(), 4).unwrap();
    let b = [2.0, 1.0, 1.0, 1.0];
    let responses = slow.analyze(&b).unwrap();
    let rows = slow.sensitivities(&b, &responses, &[ResponseAt { response: 0, point: 1 }]).unwrap();
    assert!((rows[(0, 0)] - 8.004).abs() < 1e-9, "{rows}");
    assert_eq!(rows.columns(1, 3).amax(), 0.0);
    let processes = folder.read("processes");
    let mut used: Vec<&str> = processes.lines().collect();
    used.sort_unstable();
    used.dedup();
    assert_eq!(used.len(), 4, "{processes}");
}

#[test]
fn a_refused_design_is_a_failed_analysis_and_not_repeated() {
    let folder = Folder::new("refused");
    let work = r#"echo x >> requests; printf '{"id":%s,"error":"no assembly at x = %s"}\n' "$id" "$x""#;
    let analysis = analysis(program(&folder, &script(work)));
    assert_eq!(why(analysis.analyze(&[2.5])), "no assembly at x = 2.5");
    assert_eq!(folder.read("requests").lines().count(), 1);
}

#[test]
fn a_program_that_breaks_down_is_started_again() {
    let folder = Folder::new("again");
    let work = format!("if [ ! -e broken ]; then echo 'out of licences' >&2; touch broken; exit 3; fi; {GOOD}");
    let with = |retries| analysis(ExternalProgram { retries, ..program(&folder, &script(&work)) });
    assert_eq!(with(1).analyze(&[1.0]).unwrap().values[1], [3.0]);
    std::fs::remove_file(folder.0.join("broken")).unwrap();
    let why = why(with(0).analyze(&[1.0]));
    assert!(why.contains("exit status: 3") && why.contains("`out of licences`"), "{why}");
}

/// Two processes wait, and both end at their second request.
#[test]
fn a_request_is_repeated_by_a_new_process() {
    let folder = Folder::new("new");
    let work = format!("n=$((n+1)); if [ $n -eq 2 ]; then exit 7; fi; sleep 0.5; {GOOD}");
    let analysis = analysis(ExternalProgram { jobs: 2, ..program(&folder, &script(&work)) });
    std::thread::scope(|scope| {
        let first = scope.spawn(|| analysis.analyze(&[1.0]).unwrap());
        let second = scope.spawn(|| analysis.analyze(&[2.0]).unwrap());
        (first.join().unwrap(), second.join().unwrap())
    });
    assert_eq!(analysis.analyze(&[3.0]).unwrap().values[1], [9.0]);
}

#[test]
fn what_a_program_writes_wrongly_is_named() {
    for (name, work, expected) in [
        ("rubbish", "echo hello", "it answered `hello`, which is not an answer"),
        ("other", r#"printf '{"id":0,"responses":{}}\n'"#, "to the request with the id 1"),
        ("half", r#"printf '{"id":%s,' "$id"; exit 0"#, "it ended with exit status: 0"),
        ("nothing", "exit 0", "it ended with exit status: 0"),
        ("short", r#"printf '{"id":%s,"responses":{"r":[1],"m":1}}\n' "$id""#, "1 numbers for 2 time points"),
        (
            "much",
            "while :; do printf 'xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx'; done",
            "longer than any answer",
        ),
        ("nan", r#"printf '{"id":%s,"responses":{"r":[1,NaN],"m":1}}\n' "$id""#, "NaN and Infinity are not JSON"),
    ] {
        let folder = Folder::new(name);
        let analysis = analysis(ExternalProgram { retries: 0, ..program(&folder, &script(work)) });
        let why = why(analysis.analyze(&[1.0]));
        assert!(why.contains(expected), "{name}: {why}");
    }
    let folder = Folder::new("unasked");
    let unasked = analysis(ExternalProgram { retries: 0, ..program(&folder, &script(&format!("{GOOD}; echo more"))) });
    assert!(unasked.analyze(&[1.0]).is_ok());
    std::thread::sleep(Duration::from_millis(200));
    assert_eq!(why(unasked.analyze(&[2.0])), "it wrote `more` without a request");
}

/// The program and what it started do not outlive it.
#[test]
fn a_program_that_hangs_is_ended_with_all_that_it_started() {
    let folder = Folder::new("hangs");
    let program = program(&folder, "echo $$ > processes; sleep 1000 & echo $! >> processes; wait");
    let analysis = analysis(ExternalProgram { time_limit: Duration::from_millis(500), retries: 0, ..program });
    let begun = Instant::now();
    assert_eq!(why(analysis.analyze(&[1.0])), "no answer came within 0.5 s");
    assert!(begun.elapsed() < Duration::from_secs(5));
    let processes = folder.read("processes");
    assert_eq!(processes.lines().count(), 2);
    let until = Instant::now() + Duration::from_secs(5);
    while processes.lines().any(is_running) {
        assert!(Instant::now() < until, "{processes}");
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// A program that does not end with its input is ended.
#[test]
fn nothing_is_left_behind() {
    let folder = Folder::new("left");
    let work = format!("{}\nsleep 1000", script(&format!("echo $$ >> processes; {GOOD}")));
    let analysis = analysis(program(&folder, &work));
    analysis.analyze(&[1.0]).unwrap();
    let process = folder.read("processes").trim().to_owned();
    assert!(is_running(&process));
    drop(analysis);
    assert!(!is_running(&process));
}

fn is_running(process: &str) -> bool {
    if Path::new("/proc/self/stat").exists() {
        // A process that nobody has waited for is a zombie; its parent here is the first process of the system.
        let stat = std::fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
        return stat.rsplit(") ").next().is_some_and(|rest| !rest.is_empty() && !rest.starts_with('Z'));
    }
    let status = std::process::Command::new("kill").args(["-0", process]).stderr(std::process::Stdio::null()).status();
    status.is_ok_and(|status| status.success())
}

#[test]
fn a_program_that_cannot_be_started_ends_the_run() {
    let missing = analysis(ExternalProgram::new(["./no-such-program", "x"]));
    let error = missing.analyze(&[1.0]).unwrap_err();
    assert!(matches!(&error, Error::File { .. }), "{error:?}");
    assert!(error.to_string().starts_with("./no-such-program x: the program cannot be started"), "{error}");
    assert!(ProgramAnalysis::new(ExternalProgram::new([""; 0]), ["x"], &[], [("r", false)]).is_err());
    assert!(ProgramAnalysis::new(ExternalProgram::new(["true"]), ["x"], &[], []).is_err());
    assert!(ProgramAnalysis::new(ExternalProgram::new(["true"]), ["x", "x"], &[], [("r", false)]).is_err());
}
