//! The documentation lists exactly the keys that the reader knows.

use linkwright::model_file::document;

#[test]
fn every_key_is_documented() {
    let path = format!("{}/docs/model-file.md", env!("CARGO_MANIFEST_DIR"));
    let page = std::fs::read_to_string(&path).unwrap();
    let (before, listed) = page.split_once("## All keys\n").expect("the page has a section `All keys`");
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(&path, format!("{before}## All keys\n{}", document())).unwrap();
    } else {
        assert!(listed == document(), "run this test with UPDATE_DOCS=1 to bring the page up to date");
    }
}

#[test]
fn the_listing_of_the_documentation_is_a_model() {
    let page = std::fs::read_to_string(format!("{}/docs/model-file.md", env!("CARGO_MANIFEST_DIR"))).unwrap();
    let listings: Vec<&str> = page.split("```toml\n").skip(1).map(|rest| rest.split("```").next().unwrap()).collect();
    let whole = listings.iter().find(|text| text.starts_with("version")).expect("one listing is a whole file");
    let model = linkwright::model_file::read("docs/model-file.md", whole).unwrap_or_else(|report| panic!("{report}"));
    assert!(model.method().solve(&model.problem().unwrap(), |_| ()).unwrap().status.is_success());
}

#[test]
fn the_schema_knows_every_key_of_the_examples() {
    let schema = linkwright::model_file::schema();
    for table in linkwright::model_file::tables() {
        let place = if table.name.is_empty() { &schema } else { &schema["$defs"][table.name] };
        for key in table.keys {
            assert!(place["properties"][key.name].is_object(), "{} of {}", key.name, table.name);
        }
    }
    let folder = format!("{}/examples/models", env!("CARGO_MANIFEST_DIR"));
    let items = [folder.clone(), folder + "/benchmarks"].map(|folder| std::fs::read_dir(folder).unwrap());
    for path in items.into_iter().flatten().map(|item| item.unwrap().path()) {
        if path.extension().is_none_or(|ending| ending != "toml") {
            continue;
        }
        let text = std::fs::read_to_string(&path).unwrap();
        for section in text.lines().filter_map(|line| line.strip_prefix("[[")?.strip_suffix("]]")) {
            assert!(schema["properties"][section].is_object(), "{section} in {}", path.display());
        }
    }
}
