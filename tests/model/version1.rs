//! Files of version 1 of the format: they are read to the same model as their twins of version 2, with a note.

use linkwright::model_file::{Model, read};

fn root(path: &str) -> String {
    std::fs::read_to_string(format!("{}/{path}", env!("CARGO_MANIFEST_DIR"))).unwrap()
}

fn model(text: &str) -> Model {
    read("model.toml", text).unwrap_or_else(|report| panic!("{report}"))
}

/// All histories and the derivatives of the objective at the start design, as bits.
fn bits(model: &Model) -> Vec<u64> {
    let problem = model.problem().unwrap();
    let start = problem.start();
    let responses = problem.analyze(&start).unwrap();
    let here = problem.evaluate(&start, &responses).unwrap();
    responses.values.iter().flatten().chain([&here.objective]).map(|v| v.to_bits()).collect()
}

#[test]
fn files_of_version_1_are_read_as_their_twins() {
    let folder = format!("{}/tests/model/version1", env!("CARGO_MANIFEST_DIR"));
    let mut count = 0;
    for item in std::fs::read_dir(folder).unwrap() {
        let path = item.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let twin = if name == "all-words.toml" { "tests/model" } else { "examples/models" };
        let [old, new] = [std::fs::read_to_string(&path).unwrap(), root(&format!("{twin}/{name}"))];
        let [old, new] = [old, new].map(|text| model(&text));
        assert_eq!(bits(&old), bits(&new), "{name}");
        // A stored run of the old file can be resumed with the new one.
        assert_eq!(old.fingerprint(), new.fingerprint(), "{name}");
        assert!(old.note().is_some() && new.note().is_none(), "{name}");
        count += 1;
    }
    assert!(count >= 5);
}

#[test]
fn the_note_names_the_new_words() {
    insta::assert_snapshot!("note", model(&root("tests/model/version1/all-words.toml")).note().unwrap());
    insta::assert_snapshot!(
        "note_without_old_words",
        model("version = 1\n[design.x]\nstart = 1\n[objective]\nminimize = \"x\"\n").note().unwrap()
    );
}

#[test]
fn an_old_word_in_a_new_file_is_an_error_that_names_the_new_word() {
    let text = root("tests/model/version1/all-words.toml").replacen("version = 1", "version = 2", 1);
    insta::assert_snapshot!("old_words", read("model.toml", &text).err().unwrap());
}
