//! Properties of reading any text: it is read, or rejected with a location. Used by random edits and by the fuzz targets.

use linkwright::model_file::expression::{ExpressionTree, Inputs, Names, Scope, TextPlace};
use linkwright::model_file::read;

/// Reads a text as a model file and builds its problem. Returns `true` if that is possible.
pub fn model(text: &str) -> bool {
    match read("m.toml", text) {
        Ok(model) => model.problem().is_ok(),
        Err(report) => {
            assert!(report.to_string().contains("--> m.toml:"));
            false
        }
    }
}

/// Reads a text as an expression, compiles and evaluates it. Returns `true` if that is possible.
pub fn expression(text: &str) -> bool {
    let mut names = Names::default();
    names.design("r");
    names.constant("h", 2.0);
    let expression = ExpressionTree::parse(text, TextPlace::from(0)).and_then(|tree| {
        names.expressions(vec![("named".to_owned(), tree.clone())])?;
        names.compile(&tree, &Scope::MOTION)
    });
    match expression {
        Ok(expression) => {
            // The value may be any number, but two evaluations give the same one.
            let value = || expression.value(&Inputs::at(&[1.5_f64], 0.25)).to_bits();
            assert_eq!(value(), value());
            true
        }
        Err(error) => {
            assert!(!error.message.is_empty());
            false
        }
    }
}
