//! The documentation lists exactly the keys that model files may have.

use linkwright::model_file::document;
use serde_json::Value;

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

/// Model files of the repository, with the text of the template.
fn shipped() -> Vec<(String, String)> {
    let root = env!("CARGO_MANIFEST_DIR");
    let mut folders = vec![format!("{root}/examples/models"), format!("{root}/tests/model")];
    let mut found = vec![("template".to_owned(), include_str!("../../src/command/template.toml").to_owned())];
    while let Some(folder) = folders.pop() {
        for item in std::fs::read_dir(folder).unwrap() {
            let path = item.unwrap().path();
            if path.is_dir() && path.starts_with(format!("{root}/examples")) {
                folders.push(path.display().to_string());
            } else if path.extension().is_some_and(|extension| extension == "toml") {
                found.push((path.display().to_string(), std::fs::read_to_string(&path).unwrap()));
            }
        }
    }
    found
}

#[test]
fn the_schema_accepts_every_shipped_file_and_rejects_mistakes() {
    let schema = linkwright::model_file::schema();
    let of = |text: &str| -> Result<(), String> {
        let table = toml::de::DeTable::parse(text).unwrap().into_inner();
        valid(&json(&toml::de::DeValue::Table(table)), &schema, &schema)
    };
    let files = shipped();
    assert!(files.len() > 20, "{} files", files.len());
    let wrong: Vec<String> =
        files.iter().filter_map(|(name, text)| Some(format!("{name}: {}", of(text).err()?))).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    // In space, tables have other keys.
    let space = &files.iter().find(|(name, _)| name.ends_with("spatial-slider-crank.toml")).unwrap().1;
    for (from, to) in
        [("space = 3\n", ""), ("at = \"axle\"", "at = [0, 1]"), ("kind = \"spherical\"", "kind = \"gears\"")]
    {
        assert!(space.contains(from) && of(&space.replace(from, to)).is_err(), "{to}");
    }
    let good = &files.iter().find(|(name, _)| name.ends_with("impact-absorber.toml")).unwrap().1;
    for (from, to) in [
        ("points = 101", "points = -1"),
        ("kind = \"slider\"", "kind = \"slide\""),
        ("at_most = 1.0", "atmost = 1.0"),
        ("mass = 1.0\n", "mass = true\n"),
    ] {
        assert!(good.contains(from) && of(&good.replace(from, to)).is_err(), "{to}");
    }
}

fn json(value: &toml::de::DeValue<'_>) -> Value {
    use toml::de::DeValue;
    match value {
        DeValue::String(text) => text.as_ref().into(),
        DeValue::Integer(i) => i.as_str().parse::<i64>().unwrap().into(),
        DeValue::Float(f) => f.as_str().parse::<f64>().unwrap().into(),
        DeValue::Boolean(b) => (*b).into(),
        DeValue::Datetime(d) => d.to_string().into(),
        DeValue::Array(list) => list.iter().map(|item| json(item.get_ref())).collect(),
        DeValue::Table(table) => {
            let pairs = table.iter().map(|(key, value)| (key.get_ref().to_string(), json(value.get_ref())));
            Value::Object(pairs.collect())
        }
    }
}

/// Checks a value against the parts of JSON schema that the schema uses.
fn valid(value: &Value, schema: &Value, root: &Value) -> Result<(), String> {
    let fail = |what: &str| Err(format!("{value} is not {what}"));
    for (word, rule) in schema.as_object().expect("a schema is an object") {
        match word.as_str() {
            "$ref" => {
                let name = rule.as_str().unwrap().strip_prefix("#/$defs/").unwrap();
                valid(value, &root["$defs"][name], root)?;
            }
            "type" => {
                let is = |name: &str| match name {
                    "integer" => value.is_i64() || value.is_u64(),
                    "number" => value.is_number(),
                    "string" => value.is_string(),
                    "boolean" => value.is_boolean(),
                    "array" => value.is_array(),
                    "object" => value.is_object(),
                    other => panic!("type {other}"),
                };
                let names = rule.as_array().map_or_else(|| vec![rule], |names| names.iter().collect());
                if !names.iter().any(|name| is(name.as_str().unwrap())) {
                    return fail(&rule.to_string());
                }
            }
            "minimum" if value.as_f64() < rule.as_f64() => return fail(&format!("at least {rule}")),
            "minItems" if value.as_array().map(Vec::len) < rule.as_u64().map(|n| n as usize) => return fail("so long"),
            "maxItems" if value.as_array().map(Vec::len) > rule.as_u64().map(|n| n as usize) => {
                return fail("so short");
            }
            "enum" if !rule.as_array().unwrap().contains(value) => return fail(&format!("one of {rule}")),
            "const" if value != rule => return fail(&rule.to_string()),
            "anyOf" => {
                let tried: Vec<_> = rule.as_array().unwrap().iter().map(|one| valid(value, one, root)).collect();
                if tried.iter().all(Result::is_err) {
                    return Err(tried.into_iter().filter_map(Result::err).collect::<Vec<_>>().join(", and "));
                }
            }
            "allOf" => rule.as_array().unwrap().iter().try_for_each(|one| valid(value, one, root))?,
            "if" if valid(value, rule, root).is_ok() => valid(value, &schema["then"], root)?,
            "if" if schema["else"].is_object() => valid(value, &schema["else"], root)?,
            "required" => {
                let missing = rule.as_array().unwrap().iter().find(|key| value.get(key.as_str().unwrap()).is_none());
                if let Some(key) = missing {
                    return fail(&format!("complete without {key}"));
                }
            }
            "items" => value.as_array().into_iter().flatten().try_for_each(|item| valid(item, rule, root))?,
            "properties" | "additionalProperties" if !value.is_object() => {}
            "properties" => {
                for (key, inner) in rule.as_object().unwrap() {
                    value
                        .get(key)
                        .map_or(Ok(()), |value| valid(value, inner, root))
                        .map_err(|e| format!("{key}: {e}"))?;
                }
            }
            "additionalProperties" => {
                let others = value
                    .as_object()
                    .unwrap()
                    .iter()
                    .filter(|(key, _)| schema["properties"].get(key.as_str()).is_none());
                for (key, value) in others {
                    match rule {
                        Value::Bool(false) => return Err(format!("unknown key {key}")),
                        rule => valid(value, rule, root).map_err(|e| format!("{key}: {e}"))?,
                    }
                }
            }
            "description" | "title" | "$schema" | "$defs" | "then" | "else" | "if" | "minimum" | "minItems"
            | "maxItems" | "enum" | "const" => {}
            other => panic!("the test does not know `{other}`"),
        }
    }
    Ok(())
}

/// The pages of `docs/`, by their paths from there.
fn pages() -> Vec<std::path::PathBuf> {
    let docs = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
    let mut folders = vec![docs.clone()];
    let mut found = vec![];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            match path.extension().and_then(|e| e.to_str()) {
                _ if path.is_dir() => folders.push(path),
                Some("md") => found.push(path.strip_prefix(&docs).unwrap().to_owned()),
                _ => {}
            }
        }
    }
    found.sort();
    found
}

/// The targets of links and pictures in Markdown, outside code.
fn links(text: &str) -> Vec<String> {
    let mut is_code = false;
    let mut found = vec![];
    for line in text.lines() {
        is_code ^= line.trim_start().starts_with("```");
        if is_code {
            continue;
        }
        // Every second part is in backquotes.
        let prose: String = line.split('`').step_by(2).collect();
        let targets = prose.split("](").skip(1).filter_map(|rest| rest.split([')', ' ']).next());
        found.extend(targets.map(str::to_owned));
    }
    found
}

/// The fragment of a heading, as mdBook and GitHub make it.
fn fragment(heading: &str) -> String {
    let kept = heading.trim().to_lowercase().replace(' ', "-");
    kept.chars().filter(|c| c.is_alphanumeric() || "-_".contains(*c)).collect()
}

#[test]
fn every_page_is_in_the_book_and_every_link_resolves() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let docs = root.join("docs");
    let read = |path: &std::path::Path| std::fs::read_to_string(path).unwrap();
    let listed = links(&read(&docs.join("SUMMARY.md")));
    let mut wrong = vec![];
    for page in pages() {
        let name = page.to_str().unwrap().replace('\\', "/");
        if name != "SUMMARY.md" && !listed.contains(&name) {
            wrong.push(format!("docs/SUMMARY.md lacks {name}"));
        }
        let folder = docs.join(&page).parent().unwrap().to_owned();
        for link in links(&read(&docs.join(&page))) {
            if link.contains("://") || link.starts_with("mailto:") {
                continue;
            }
            let (file, heading) = link.split_once('#').unwrap_or((&link, ""));
            let target = if file.is_empty() { docs.join(&page) } else { folder.join(file) };
            let target = target.canonicalize().unwrap_or(target);
            if !target.exists() {
                wrong.push(format!("docs/{name}: {link} does not exist"));
            } else if !target.starts_with(docs.canonicalize().unwrap()) {
                wrong.push(format!(
                    "docs/{name}: {link} is outside the book; give its address on the web, or its path as code"
                ));
            } else if !heading.is_empty() {
                let known = read(&target);
                let mut headings =
                    known.lines().filter(|l| l.starts_with('#')).map(|l| fragment(l.trim_start_matches('#')));
                if !headings.any(|known| known == heading) {
                    wrong.push(format!("docs/{name}: {link} names no heading"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The reference states a formula, with signs, for every joint, drive, force and contact.
#[test]
fn every_joint_drive_force_and_contact_has_its_law() {
    let text = document();
    let entries: Vec<&str> = text.split("\n**`kind = \"").skip(1).collect();
    let elements = entries.iter().filter(|entry| entry.lines().next().unwrap().contains("`** ("));
    let without = elements.filter(|entry| !entry.contains("\n\nLaw: "));
    let without: Vec<&str> = without.map(|entry| entry.split('"').next().unwrap()).collect();
    assert!(without.is_empty(), "{without:?}");
}
