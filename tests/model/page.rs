//! A small HTML reader: checks that elements are closed in order, and outlines a page.

/// A tag with its attributes as text.
pub struct Tag {
    pub name: String,
    pub attributes: String,
    pub closes: bool,
    /// The text up to the next tag.
    pub text: String,
}

const VOID: [&str; 3] = ["meta", "input", "link"];

/// All tags in order. Panics if a `<` begins no tag, or an attribute has no quotes.
pub fn tags(page: &str) -> Vec<Tag> {
    let mut rest = page.strip_prefix("<!DOCTYPE html>").expect("a page begins with its type");
    let mut tags = vec![];
    while let Some(at) = rest.find('<') {
        let end = at + rest[at..].find('>').expect("every tag ends");
        let inside = &rest[at + 1..end];
        assert_eq!(inside.matches('"').count() % 2, 0, "quotes of <{inside}>");
        let (closes, inside) = inside.strip_prefix('/').map_or((false, inside), |inside| (true, inside));
        let name: String = inside.chars().take_while(|c| c.is_ascii_alphanumeric()).collect();
        assert!(!name.is_empty(), "<{inside}> is not a tag");
        let attributes = inside[name.len()..].trim_end_matches('/').to_owned();
        let alone = inside.ends_with('/');
        rest = &rest[end + 1..];
        // The content of scripts and styles is not HTML.
        let text_end = if !closes && (name == "script" || name == "style") {
            rest.find(&format!("</{name}>")).expect("it ends")
        } else {
            rest.find('<').unwrap_or(rest.len())
        };
        let text = rest[..text_end].to_owned();
        rest = &rest[text_end..];
        tags.push(Tag { name: name.clone(), attributes, closes, text: text.clone() });
        if alone {
            tags.push(Tag { name, attributes: String::new(), closes: true, text });
        }
    }
    tags
}

/// Panics unless all elements are closed in order.
pub fn check(page: &str) {
    let mut open: Vec<String> = vec![];
    for tag in tags(page) {
        match (tag.closes, VOID.contains(&tag.name.as_str())) {
            (_, true) => {}
            (false, _) => open.push(tag.name),
            (true, _) => assert_eq!(open.pop().as_ref(), Some(&tag.name), "inside {open:?}"),
        }
    }
    assert!(open.is_empty(), "{open:?} are not closed");
}

/// Panics if an element loads anything, or a link leads outside the page and its folder.
pub fn assert_self_contained(page: &str) {
    for tag in tags(page) {
        let Tag { name, attributes, text, .. } = &tag;
        assert!(
            !["link", "img", "iframe", "object", "embed", "use", "image", "base"].contains(&name.as_str()),
            "<{name}>"
        );
        for attribute in [" src", " srcset", "xlink", " on", " style=", " data="] {
            assert!(!attributes.contains(attribute), "<{name}{attributes}>");
        }
        let links = attributes.split("href=\"").skip(1).chain(attributes.split("url(").skip(1));
        for link in links {
            let elsewhere = ["http", "//", "/", "data:", "javascript:"].iter().any(|begin| link.starts_with(begin));
            assert!(!elsewhere, "<{name}{attributes}>");
        }
        if name == "style" || name == "script" {
            for word in ["@import", "url(", "http:", "https:", "fetch(", "XMLHttpRequest", "import("] {
                assert!(!text.contains(word), "{word} in a {name}");
            }
        }
    }
}

/// Headings, captions of tables and figures, and headings of columns, a line each.
pub fn outline(page: &str) -> String {
    let mut lines: Vec<String> = vec![];
    for tag in tags(page).iter().filter(|tag| !tag.closes) {
        let text = tag.text.trim().replace('\n', " ");
        match tag.name.as_str() {
            "h1" => lines.push(format!("# {text}")),
            "h2" => lines.push(format!("## {text}")),
            "h3" => lines.push(format!("### {text}")),
            "caption" => lines.push(format!("table: {text}")),
            "th" if tag.attributes.contains("col") => {
                let last = lines.last_mut().expect("a table has a caption");
                last.push_str(" | ");
                last.push_str(&text);
            }
            "figcaption" => lines.push(format!("figure: {text}")),
            "summary" => lines.push(format!("listing: {text}")),
            "a" => lines.push(format!("link: {}", tag.attributes.trim())),
            _ => {}
        }
    }
    lines.join("\n")
}

#[test]
fn unclosed_elements_are_found() {
    check("<!DOCTYPE html><html><p a=\"b\">x<meta b=\"c\"><path d=\"M0 0\"/></p></html>");
    for broken in ["<p>", "<p></b></p>", "<p a=\"></p>", "< p>"] {
        assert!(std::panic::catch_unwind(|| check(&format!("<!DOCTYPE html>{broken}"))).is_err(), "{broken}");
    }
}
