//! An expression of any bytes: read, or refused with a reason.
#![no_main]

#[allow(dead_code)]
#[path = "../../tests/model/harmless.rs"]
mod harmless;

libfuzzer_sys::fuzz_target!(|text: &str| {
    harmless::expression(text);
});
