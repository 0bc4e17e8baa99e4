//! Default classes: attributes that elements of a class have unless they say otherwise.

use crate::model_file::robot::xml::XmlElement;
use crate::{Error, Result};
use std::collections::HashMap;

/// Attributes of the elements of a name.
type Attributes = HashMap<String, HashMap<String, String>>;

/// Largest nesting depth of classes.
const DEPTH: usize = 50;

/// The classes of a file by name; the class without a name is `main`.
pub struct Defaults {
    classes: HashMap<String, Attributes>,
}

/// Name of the outermost class.
pub const MAIN: &str = "main";

impl Defaults {
    /// Reads all elements `default` of the root.
    pub fn of(root: &XmlElement) -> Result<Self> {
        let mut all = Self { classes: HashMap::from([(MAIN.to_owned(), Attributes::new())]) };
        for element in root.all("default") {
            let name = element.attribute("class").unwrap_or(MAIN);
            all.add(element, name, MAIN, DEPTH)?;
        }
        Ok(all)
    }

    /// Adds the class of an element `default`, which begins with the attributes of the class `outer`, and the classes in it.
    fn add(&mut self, element: &XmlElement, name: &str, outer: &str, depth: usize) -> Result<()> {
        let Some(depth) = depth.checked_sub(1) else {
            return Err(element.bad(
                "<default>",
                &format!("classes are nested more than {DEPTH} levels deep"),
                "flatten them",
            ));
        };
        let mut own = self.classes.get(name).or_else(|| self.classes.get(outer)).cloned().unwrap_or_default();
        for child in element.children.iter().filter(|child| child.name != "default") {
            let attributes = own.entry(child.name.clone()).or_default();
            for (key, value) in &child.attributes {
                forget_alternatives(attributes, key);
                attributes.insert(key.clone(), value.clone());
            }
        }
        self.classes.insert(name.to_owned(), own);
        for child in element.all("default") {
            let inner = child.text("<default>", "class")?;
            self.add(child, inner, name, depth)?;
        }
        Ok(())
    }

    /// An element with the attributes of its class, or of `class` if it names none.
    pub fn apply(&self, element: &XmlElement, class: &str) -> Result<XmlElement> {
        let name = element.attribute("class").unwrap_or(class);
        let Some(class) = self.classes.get(name) else {
            let error = Error::unknown("class", name, self.classes.keys().map(String::as_str));
            return Err(element.bad(&format!("<{}>", element.name), &error.to_string(), "name a class of <default>"));
        };
        let Some(own) = class.get(&element.name) else { return Ok(element.clone()) };
        let mut own = own.clone();
        element.attributes.iter().for_each(|(key, _)| forget_alternatives(&mut own, key));
        let mut all = XmlElement { children: vec![], ..element.clone() };
        // A size with fewer numbers replaces only the first ones of the default.
        if let (Some(size), Some(default)) = (all.attributes.iter_mut().find(|(key, _)| key == "size"), own.get("size"))
        {
            let given = size.1.split_whitespace().count();
            default.split_whitespace().skip(given).for_each(|word| size.1 += &format!(" {word}"));
        }
        all.attributes.extend(own.into_iter().filter(|(key, _)| element.attribute(key).is_none()));
        Ok(all)
    }

    /// True if there is a class of this name.
    pub fn has(&self, name: &str) -> bool {
        self.classes.contains_key(name)
    }
}

/// Ways to give an orientation, of which a later one replaces an earlier one.
const ORIENTATIONS: [&str; 5] = ["quat", "axisangle", "euler", "xyaxes", "zaxis"];

fn forget_alternatives(attributes: &mut HashMap<String, String>, key: &str) {
    if ORIENTATIONS.contains(&key) {
        ORIENTATIONS.iter().for_each(|other| drop(attributes.remove(*other)));
    }
}
