//! Elements of an XML file with their places, and their attributes as numbers.

use crate::{Error, Result};
use nalgebra::Vector3;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Largest size of the file of a robot in bytes, with all files that it includes.
pub const LIMIT: usize = 8 << 20;

/// Largest nesting depth of elements.
const DEPTH: usize = 200;
/// Largest depth of files that include each other.
const FILES: usize = 8;

/// An element with its attributes and the elements in it.
#[derive(Clone, Debug)]
pub struct XmlElement {
    pub name: String,
    pub attributes: Vec<(String, String)>,
    pub children: Vec<XmlElement>,
    /// The namespace of its name, if it has one.
    pub namespace: Option<String>,
    pub(super) line: usize,
    /// The included file that contains it; `None` for the first file.
    pub(super) file: Option<Arc<str>>,
}

/// Reads an included file by the name that the including file gives.
pub type Include<'a> = dyn Fn(&str) -> Result<String> + 'a;

/// The outermost element of a text, with all that it includes by elements `include`.
pub fn parse(file: &str, text: &str, include: &Include<'_>) -> Result<XmlElement> {
    let mut size = text.len();
    let mut include = |name: &str| {
        let text = include(name)?;
        size += text.len();
        let why = format!("with `{name}` it has {size} bytes, more than {LIMIT}");
        if size > LIMIT { Err(Error::definition(file, why, "include less")) } else { Ok(text) }
    };
    parse_file(file, None, text, &mut include, FILES)
}

/// As [`parse`], for a file that another one includes as `own`; at most `depth` further levels of files may be included.
fn parse_file(
    file: &str,
    own: Option<Arc<str>>,
    text: &str,
    include: &mut dyn FnMut(&str) -> Result<String>,
    depth: usize,
) -> Result<XmlElement> {
    let document = roxmltree::Document::parse(text).map_err(|error| {
        let remedy = match error {
            roxmltree::Error::DtdDetected => "remove the document type and write out its entities",
            _ => "repair the XML",
        };
        Error::definition(file, error.to_string(), remedy)
    })?;
    let lines: Vec<usize> = text.match_indices('\n').map(|(at, _)| at).collect();
    let mut root = copied(document.root_element(), own.as_ref(), &lines, DEPTH).ok_or_else(|| {
        Error::definition(file, format!("elements are nested more than {DEPTH} levels deep"), "flatten it")
    })?;
    // Other formats have elements of this name, which mean something else.
    if own.is_some() || root.name == "mujoco" {
        insert_files(&mut root, include, depth)?;
    }
    Ok(root)
}

/// The element with all in it; `None` if they are nested too deeply. `lines` are the ends of the lines of the text.
fn copied(node: roxmltree::Node<'_, '_>, file: Option<&Arc<str>>, lines: &[usize], depth: usize) -> Option<XmlElement> {
    let depth = depth.checked_sub(1)?;
    let children = node.children().filter(roxmltree::Node::is_element).map(|child| copied(child, file, lines, depth));
    let line = 1 + lines.partition_point(|end| *end < node.range().start);
    Some(XmlElement {
        name: node.tag_name().name().to_owned(),
        namespace: node.tag_name().namespace().map(str::to_owned),
        attributes: node.attributes().map(|a| (a.name().to_owned(), a.value().trim().to_owned())).collect(),
        children: children.collect::<Option<_>>()?,
        line,
        file: file.cloned(),
    })
}

/// Puts the elements of included files in place of the elements `include`.
fn insert_files(element: &mut XmlElement, include: &mut dyn FnMut(&str) -> Result<String>, depth: usize) -> Result<()> {
    let mut all = vec![];
    for mut child in std::mem::take(&mut element.children) {
        if child.name != "include" {
            insert_files(&mut child, include, depth)?;
            all.push(child);
            continue;
        }
        let name = child.text("<include>", "file")?.to_owned();
        let Some(depth) = depth.checked_sub(1) else {
            return Err(child.bad("<include>", &format!("more than {FILES} files include each other"), "flatten them"));
        };
        let text = include(&name)?;
        all.extend(parse_file(&name, Some(name.as_str().into()), &text, include, depth)?.children);
    }
    element.children = all;
    Ok(())
}

impl XmlElement {
    /// The elements of a name.
    pub fn all<'a>(&'a self, name: &'static str) -> impl Iterator<Item = &'a Self> + Clone {
        self.children.iter().filter(move |child| child.name == name)
    }

    /// The first element of a name.
    pub fn first<'a>(&'a self, name: &'static str) -> Option<&'a Self> {
        self.all(name).next()
    }

    /// This element and all its descendants.
    pub fn descendants(&self) -> Box<dyn Iterator<Item = &Self> + '_> {
        Box::new(std::iter::once(self).chain(self.children.iter().flat_map(Self::descendants)))
    }

    /// An attribute, if it is there.
    pub fn attribute(&self, key: &str) -> Option<&str> {
        self.attributes.iter().find(|(name, _)| name == key).map(|(_, value)| value.as_str())
    }

    /// An attribute that must be there and not be empty; `what` names the element in messages.
    pub fn text(&self, what: &str, key: &str) -> Result<&str> {
        let why = || self.bad(what, &format!("it has no attribute `{key}`"), "add it");
        self.attribute(key).filter(|text| !text.is_empty()).ok_or_else(why)
    }

    pub fn number(&self, what: &str, key: &str) -> Result<Option<f64>> {
        self.attribute(key).map(|text| self.parsed(what, key, text)).transpose()
    }

    pub fn triple(&self, what: &str, key: &str) -> Result<Option<Vector3<f64>>> {
        let Some(text) = self.attribute(key) else { return Ok(None) };
        Ok(Some(Vector3::from(self.exactly(what, key, text)?)))
    }

    /// `N` numbers in the text of an attribute.
    pub fn exactly<const N: usize>(&self, what: &str, key: &str, text: &str) -> Result<[f64; N]> {
        let all = self.numbers(what, key, text)?;
        let why = format!("`{key}` has {} numbers", all.len());
        let names = ["none", "one", "two", "three", "four", "five", "six"];
        all.try_into().map_err(|_| self.bad(what, &why, &format!("give {}", names.get(N).unwrap_or(&"more"))))
    }

    /// All numbers in the text of an attribute.
    pub fn numbers(&self, what: &str, key: &str, text: &str) -> Result<Vec<f64>> {
        text.split_whitespace().map(|word| self.parsed(what, key, word)).collect()
    }

    fn parsed(&self, what: &str, key: &str, text: &str) -> Result<f64> {
        let value = text.parse::<f64>().ok().filter(|value| value.abs() < 1e30);
        value.ok_or_else(|| self.bad(what, &format!("`{key}` is `{}`", shortened(text, 40)), "give a finite number"))
    }

    /// An error at this element.
    pub fn bad(&self, what: &str, why: &str, remedy: &str) -> Error {
        Error::definition(format!("{} ({})", shortened(what, 100), self.place()), why, remedy)
    }

    /// Its place for messages.
    pub fn place(&self) -> String {
        match &self.file {
            Some(file) => format!("line {} of {}", self.line, shortened(file, 100)),
            None => format!("line {}", self.line),
        }
    }
}

/// The beginning of a text for a message.
pub fn shortened(text: &str, most: usize) -> String {
    text.chars().take(most).filter(|c| !c.is_control()).collect()
}

/// Numbers of the elements that are left out, by name.
#[derive(Default)]
pub struct Counts(BTreeMap<String, usize>);

impl Counts {
    pub fn add_all<'a>(&mut self, elements: impl IntoIterator<Item = &'a XmlElement>) {
        elements.into_iter().for_each(|element| *self.0.entry(element.name.clone()).or_default() += 1);
    }

    pub fn sentences(self) -> Vec<String> {
        self.0.into_iter().map(|(name, count)| format!("<{name}> ({count}) was left out")).collect()
    }
}
