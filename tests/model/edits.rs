//! Random edits of all example files, and random expressions. A million of each take minutes:
//! `INPUTS=1000000 cargo test --release --test model edits`.

use crate::any_text;

const GOOD: &str = include_str!("good.toml");

fn inputs() -> usize {
    std::env::var("INPUTS").ok().and_then(|n| n.parse().ok()).unwrap_or(20_000)
}

/// SplitMix64: the same numbers in every run.
struct Draw(u64);

impl Draw {
    fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) as usize % end
    }
}

#[test]
fn random_edits_are_read_or_rejected() {
    let count = inputs();
    let folder = format!("{}/examples/models", env!("CARGO_MANIFEST_DIR"));
    let files = std::fs::read_dir(folder).unwrap().map(|f| f.unwrap().path());
    let files = files.filter(|path| path.is_file()).map(|path| std::fs::read_to_string(path).unwrap());
    let mut files: Vec<String> = files.chain([GOOD.to_owned()]).collect();
    files.sort();
    let files: Vec<Vec<char>> = files.iter().map(|text| text.chars().collect()).collect();
    let mut draw = Draw(1);
    let mut good = 0;
    for _ in 0..count {
        let mut text = files[draw.below(files.len())].clone();
        for _ in 0..=draw.below(3) {
            // A piece goes from one place to another, or a digit, sign or letter changes.
            let (from, to) = (draw.below(text.len()), draw.below(text.len()));
            match draw.below(4) {
                0 => text[to] = text[from],
                1 => drop(text.drain(from..(from + draw.below(30)).min(text.len()))),
                2 => {
                    let piece = text[from..(from + draw.below(30)).min(text.len())].to_vec();
                    drop(text.splice(to..to, piece));
                }
                _ => text[to] = b"0123456789.-+*/^()[]{}\"'=,#\n eEinf_"[draw.below(35)] as char,
            }
            if text.is_empty() {
                break;
            }
        }
        good += usize::from(any_text::model(&text.into_iter().collect::<String>()));
    }
    // Many single edits leave a file valid, so the edits test more than the parser.
    assert!(good > count / 20, "{good} of {count} were read");
}

#[test]
fn random_expressions_are_read_or_rejected() {
    const PIECES: &[&str] = &[
        "1", "2.5", "1e300", "0", ".5", "pi", "r", "h", "time", "named", "x", "+", "-", "*", "/", "^", "(", ")", "(",
        ")", ",", "sin(", "ln(", "sqrt(", "atan2(", "max(", "deg(", "pow(", "e", " ", "\u{3b2}", "1e999",
    ];
    let count = inputs();
    let mut draw = Draw(2);
    let mut good = 0;
    for _ in 0..count {
        let length = 1 + draw.below(8);
        let text: String = (0..length).map(|_| PIECES[draw.below(PIECES.len())]).collect();
        good += usize::from(any_text::expression(&text));
    }
    assert!(good > count / 50, "{good} of {count} were read");
}
