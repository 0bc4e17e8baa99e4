//! `linkwright open` and what happens outside of its page: other editors, a lost connection, other processes in the folder of a run.

use crate::devtools::Page;
use crate::open::{Server, rests, served, shown, start_design, wait};
use crate::shell::TempFolder;
use serde_json::{Value, json};
use std::time::Duration;

const STATE: &str = "document.getElementById('source-state').textContent";
const SAVE: &str = "document.getElementById('save')";

/// Puts a text into the editor as a user types it.
fn put(page: &mut Page, text: &str) {
    page.value(&format!(
        "(() => {{ const e = document.getElementById('text'); e.value = {}; e.dispatchEvent(new Event('input')); return 0; }})()",
        json!(text)
    ));
}

fn edited(name: &str) -> Option<(TempFolder, Server, Page)> {
    shown(name, "impact-absorber", [1400, 1200])
}

/// A file that was changed by another editor is replaced after a question, which stays until it is answered.
#[test]
fn saving_over_a_changed_file_asks_once() {
    let Some((place, _server, mut page)) = edited("open-over") else { return };
    let file = place.0.join("impact-absorber.toml");
    let text = place.read("impact-absorber.toml");
    let own = format!("{text}# typed here\n");
    put(&mut page, &own);
    page.wait(&format!("{STATE}.includes('kept in')"));
    std::fs::write(&file, format!("{text}# another editor\n")).unwrap();
    page.wait(&format!("{STATE}.includes('has changed on disk')"));
    page.click("#save");
    page.wait(&format!("{SAVE}.textContent === 'Replace the changed file'"));
    // News of the server do not withdraw the question.
    std::thread::sleep(Duration::from_millis(800));
    assert_eq!(page.text(&format!("{SAVE}.textContent")), "Replace the changed file");
    assert!(page.text(STATE).contains("Saving again replaces it"));
    page.click("#save");
    page.wait(&format!("{SAVE}.disabled && {STATE} === 'saved'"));
    assert_eq!(place.read("impact-absorber.toml"), own);
    assert_eq!(page.text(&format!("{SAVE}.textContent")), "Save");
}

/// Text that is typed without a connection is not called saved, and is sent when the server answers again.
#[test]
fn text_typed_without_a_connection_is_sent_later() {
    let Some((place, _server, mut page)) = edited("open-offline") else { return };
    let network = |page: &mut Page, offline: bool| {
        let none = json!({ "offline": offline, "latency": 0, "downloadThroughput": -1, "uploadThroughput": -1 });
        page.call("Network.emulateNetworkConditions", none);
    };
    page.call("Network.enable", json!({}));
    network(&mut page, true);
    let own = format!("{}# offline text\n", place.read("impact-absorber.toml"));
    put(&mut page, &own);
    page.wait(&format!("{STATE}.startsWith('not sent')"));
    assert_eq!(page.value(&format!("{SAVE}.disabled")), false);
    network(&mut page, false);
    page.wait(&format!("{STATE}.includes('kept in')"));
    assert!(place.read("impact-absorber.toml.unsaved").starts_with(&own));
    assert_eq!(page.text("document.getElementById('text').value"), own);
    assert_eq!(page.text("document.documentElement.dataset.state"), "ready");
}

/// A page whose server has ended says so and how to go on; it keeps the text that was not sent, and a new server has the one that was.
#[test]
fn a_page_whose_server_has_ended_says_how_to_go_on() {
    let Some((place, server, mut page)) = edited("open-ended") else { return };
    let lost = "document.getElementById('lost')";
    assert_eq!(page.value(&format!("{lost}.hidden")), true);
    let sent = format!("{}# sent\n", place.read("impact-absorber.toml"));
    put(&mut page, &sent);
    page.wait(&format!("{STATE}.includes('kept in')"));
    drop(server);
    page.wait(&format!("!{lost}.hidden"));
    let words = page.text(&format!("{lost}.innerText"));
    assert!(words.contains("linkwright open impact-absorber.toml") && words.contains("another address"), "{words}");
    assert!(words.contains("impact-absorber.toml.unsaved"), "{words}");
    // No button of the run seems to work.
    assert_eq!(page.value("document.getElementById('run').inert"), true);
    put(&mut page, &format!("{sent}# not sent\n"));
    page.wait(&format!("{lost}.querySelector('button') && {lost}.innerText.includes('only in this page')"));
    page.views("ended", "body");
    page.click("#lost button");
    page.wait(&format!("/^Copied|by hand/.test({lost}.querySelector('button').textContent)"));
    assert!(page.text("document.getElementById('text').value").ends_with("# not sent\n"));

    let server = Server::start(&place.0, "impact-absorber.toml");
    let program = crate::browser::browser().unwrap();
    // The page before would ask whether its text is to be dropped.
    let mut page = Page::open(&program, &place.0, [1300, 1200]);
    page.show(&server.address());
    page.wait("document.getElementById('text').value.endsWith('# sent\\n')");
    assert_eq!(page.value(&format!("{lost}.hidden")), true);
}

/// A file that is gone, or no text any more, is named as such, and Save writes it again.
#[test]
fn a_file_that_is_gone_or_unreadable_is_written_again() {
    let Some((place, _server, mut page)) = edited("open-gone") else { return };
    let file = place.0.join("impact-absorber.toml");
    let text = place.read("impact-absorber.toml");
    std::fs::remove_file(&file).unwrap();
    page.wait(&format!("{STATE}.includes('cannot read') && !{SAVE}.disabled"));
    page.wait("document.getElementById('fault').textContent.includes('cannot read')");
    page.click("#save");
    page.wait(&format!("{SAVE}.disabled && {STATE} === 'saved'"));
    assert_eq!(place.read("impact-absorber.toml"), text);
    page.wait("document.getElementById('fault').hidden");

    std::fs::write(&file, [0xff, 0xfe, 0, 1]).unwrap();
    page.wait(&format!("{STATE}.includes('not UTF-8')"));
    page.click("#save");
    page.wait(&format!("{SAVE}.textContent === 'Replace the changed file'"));
    page.click("#save");
    page.wait(&format!("{SAVE}.disabled && {STATE} === 'saved'"));
    assert_eq!(place.read("impact-absorber.toml"), text);
}

/// A run that is paused in a page can be continued by other processes, is listed by them with its own status, and keeps this status.
#[test]
fn a_run_that_rests_is_not_running_and_keeps_its_status() {
    let (place, server) = served("open-rest", "shaper");
    let listed = |status: &str| {
        let runs = place.run(&["runs"], 0);
        assert!(runs.contains(status) && !runs.contains("Running"), "{status}: {runs}");
        assert_eq!(server.get("stored")["stored"][0]["status"], status);
    };
    server.act(&json!({ "action": "start", "design": start_design(&server.get("model")) }));
    server.act(&json!({ "action": "step" }));
    let one = rests(&server, "Paused", |tries| tries == 1);
    listed("Interrupted");
    server.act(&json!({ "action": "run" }));
    let end = rests(&server, "Converged", |_| true);
    listed("Converged");

    // Taken up again and closed, it is as before.
    server.act(&json!({ "action": "close" }));
    wait(&server, "run", "closed", |value| value["run"].is_null());
    server.act(&json!({ "action": "resume", "folder": "out/shaper" }));
    let again = rests(&server, "Converged", |_| true);
    assert_eq!(again["cycles"], end["cycles"]);
    server.act(&json!({ "action": "close" }));
    wait(&server, "run", "closed", |value| value["run"].is_null());
    listed("Converged");
    let summary: Value = serde_json::from_str(&place.read("out/shaper/summary.json")).unwrap();
    assert_eq!(summary["status"], "Converged");

    // The command continues a run that is paused in the page, and the page then continues from the last step of the command.
    server.act(&json!({ "action": "start", "design": start_design(&server.get("model")) }));
    server.act(&json!({ "action": "step" }));
    rests(&server, "Paused", |tries| tries == 1);
    place.run(&["resume", "out/shaper-2", "--quiet"], 0);
    server.act(&json!({ "action": "run" }));
    let end = rests(&server, "Converged", |tries| tries > 1);
    assert_eq!(end["cycles"][1], one["cycles"][1]);
    assert_eq!(end["can_go_back"], false);
}
