//! A model file of any bytes: it is read, or rejected with a diagnostic.
#![no_main]

#[allow(dead_code)]
#[path = "../../tests/model/any_text.rs"]
mod any_text;

libfuzzer_sys::fuzz_target!(|text: &str| {
    any_text::model(text);
});
