//! Answers of a program by design, in memory and optionally in a file.
//!
//! The first line of the file names the program, the variables, the time points and the responses. Each further line is an answer with
//! its design and a hash, in the order in which the answers came:
//!
//! ```json
//! {"linkwright":1,"command":["python3","truss.py"],"variables":["area","span"],"times":[],"responses":["stress"]}
//! {"hash":"c5f2…","design":{"area":1.5,"span":0.5},"responses":{"stress":0.92}}
//! ```

use super::protocol::{self, Answer, Declared, ProgramResponse, VERSION};
use crate::storage::{Appender, Directory, fnv1a};
use error::{Error, Result};
use serde::Serialize;
use std::collections::{BTreeMap, VecDeque};
use std::io::{self, BufRead, BufReader, Read};
use std::sync::Arc;

/// Largest number of numbers in memory: 128 MiB.
const KEPT: usize = 1 << 24;

/// Answers by the bits of their designs. The oldest are removed first; the file has all of them.
#[derive(Default)]
pub struct Answers {
    by_design: BTreeMap<Vec<u64>, Arc<Answer>>,
    order: VecDeque<Vec<u64>>,
    numbers: usize,
    file: Option<(Appender, String)>,
}

fn key(design: &[f64]) -> Vec<u64> {
    design.iter().map(|x| x.to_bits()).collect()
}

impl Answers {
    /// The answer at a design.
    pub fn at(&self, design: &[f64]) -> Option<Arc<Answer>> {
        self.by_design.get(&key(design)).cloned()
    }

    /// Adds an answer, to the file, too.
    ///
    /// # Errors
    /// [`Error::File`] if the file cannot be written.
    pub fn add(&mut self, declared: &Declared, design: &[f64], answer: &Arc<Answer>) -> Result<()> {
        self.keep(key(design), answer);
        let Some((file, place)) = &mut self.file else { return Ok(()) };
        file.append(line(declared, design, answer).as_bytes()).map_err(|why| unwritable(place, &why))
    }

    fn keep(&mut self, key: Vec<u64>, answer: &Arc<Answer>) {
        self.numbers += answer.numbers();
        match self.by_design.insert(key.clone(), Arc::clone(answer)) {
            Some(replaced) => self.numbers -= replaced.numbers(),
            None => self.order.push_back(key),
        }
        while self.numbers > KEPT
            && let Some(oldest) = self.order.pop_front()
        {
            self.numbers -= self.by_design.remove(&oldest).map_or(0, |answer| answer.numbers());
        }
    }

    /// Reads the answers in a file, if it exists and belongs to this program and these requests. Returns the length of its complete
    /// lines, which is 0 otherwise.
    ///
    /// # Errors
    /// [`Error::File`] if the file cannot be read, or if a line is damaged.
    pub fn read_from(
        &mut self,
        directory: &Directory,
        name: &str,
        command: &[String],
        declared: &Declared,
    ) -> Result<u64> {
        let place = place(directory, name);
        let file = directory.reader(name).map_err(|why| unreadable(&place, &why))?;
        let head = head(command, declared);
        file.map_or(Ok(0), |file| self.read(&mut BufReader::new(file), &head, declared, &place))
    }

    /// As [`read_from`](Self::read_from), and appends answers that the file lacks and all further ones. A file of another program or of
    /// other requests is replaced; an incomplete last line, which remains if the process is killed, is removed.
    ///
    /// # Errors
    /// Those of [`read_from`](Self::read_from), and [`Error::File`] if the file cannot be written.
    pub fn keep_in(
        &mut self,
        directory: &Directory,
        name: &str,
        command: &[String],
        declared: &Declared,
    ) -> Result<()> {
        let known = std::mem::take(self);
        let length = self.read_from(directory, name, command, declared)?;
        let open = || {
            let mut file = directory.appender(name)?;
            if file.length()? > length {
                file.cut(length)?;
            }
            if length == 0 {
                file.append(head(command, declared).as_bytes())?;
            }
            Ok(file)
        };
        let place = place(directory, name);
        let file = open().map_err(|why| unwritable(&place, &why))?;
        self.file = Some((file, place));
        for key in known.order.iter().filter(|key| !self.by_design.contains_key(*key)).cloned().collect::<Vec<_>>() {
            let design: Vec<f64> = key.iter().map(|bits| f64::from_bits(*bits)).collect();
            self.add(declared, &design, &known.by_design[&key])?;
        }
        Ok(())
    }

    /// Reads complete lines and returns their length; 0 if the first one is not `head`.
    fn read(&mut self, reader: &mut impl BufRead, head: &str, declared: &Declared, place: &str) -> Result<u64> {
        let longest = (protocol::longest(declared).max(head.len()) + 1) as u64;
        let (mut length, mut number) = (0, 0);
        loop {
            let mut line = Vec::new();
            let read = reader.by_ref().take(longest).read_until(b'\n', &mut line);
            read.map_err(|why| unreadable(place, &why))?;
            number += 1;
            if line.last() != Some(&b'\n') {
                if line.len() as u64 == longest {
                    return Err(damaged(place, number));
                }
                return Ok(length);
            }
            if number == 1 && line != head.as_bytes() {
                return Ok(0);
            }
            if number > 1 {
                let (design, answer) = answer_of(declared, &line).ok_or_else(|| damaged(place, number))?;
                self.keep(key(&design), &Arc::new(answer));
            }
            length += line.len() as u64;
        }
    }
}

fn file_error(place: &str, why: String, remedy: &str) -> Error {
    Error::File { file: place.to_owned(), why, remedy: remedy.to_owned() }
}

fn place(directory: &Directory, name: &str) -> String {
    directory.path().join(name).display().to_string()
}

fn unreadable(place: &str, why: &io::Error) -> Error {
    file_error(place, format!("cannot be read: {why}"), "remove it: its designs are then analysed again")
}

fn unwritable(place: &str, why: &io::Error) -> Error {
    file_error(place, format!("cannot be written: {why}"), "free space or get write permission, then resume the run")
}

fn damaged(place: &str, line: usize) -> Error {
    file_error(
        place,
        format!("line {line} is damaged or not an answer of this program"),
        "remove the file: its designs are then analysed again",
    )
}

/// The first line. Answers in a file with another first line belong to another program or to other requests.
fn head(command: &[String], declared: &Declared) -> String {
    #[derive(Serialize)]
    struct AnswersHead<'a> {
        linkwright: u32,
        command: &'a [String],
        variables: &'a [String],
        times: &'a [f64],
        responses: Vec<&'a str>,
    }
    let Declared { variables, times, responses } = declared;
    let responses = responses.iter().map(|response| response.name.as_str()).collect();
    let head = AnswersHead { linkwright: VERSION, command, variables, times, responses };
    serde_json::to_string(&head).expect("numbers and names are JSON") + "\n"
}

/// A number for each time point, or one number.
#[derive(Serialize)]
#[serde(untagged)]
enum Numbers<'a> {
    History(&'a [f64]),
    One(f64),
}

impl<'a> Numbers<'a> {
    fn new(response: &ProgramResponse, values: &'a [f64]) -> Self {
        if response.is_history { Self::History(values) } else { Self::One(values[0]) }
    }
}

/// The line of an answer.
fn line(declared: &Declared, design: &[f64], answer: &Answer) -> String {
    #[derive(Serialize)]
    struct AnswerLine<'a> {
        design: BTreeMap<&'a str, f64>,
        responses: BTreeMap<&'a str, Numbers<'a>>,
        #[serde(skip_serializing_if = "Option::is_none")]
        derivatives: Option<BTreeMap<&'a str, BTreeMap<&'a str, Numbers<'a>>>>,
    }
    let names = || declared.variables.iter().map(String::as_str);
    let responses = || declared.responses.iter();
    let values = responses().zip(&answer.values);
    let derivatives = answer.derivatives.as_ref().map(|all| {
        let of_variables = responses().zip(all);
        let named = of_variables.map(|(response, all)| {
            let numbers = all.iter().map(|values| Numbers::new(response, values));
            (response.name.as_str(), names().zip(numbers).collect())
        });
        named.collect()
    });
    let line = AnswerLine {
        design: names().zip(design.iter().copied()).collect(),
        responses: values.map(|(response, v)| (response.name.as_str(), Numbers::new(response, v))).collect(),
        derivatives,
    };
    let text = serde_json::to_string(&line).expect("numbers and names are JSON");
    format!("{{\"hash\":\"{:016x}\",{}\n", fnv1a(&text), &text[1..])
}

/// The design and the answer in a line; `None` if it is not exactly what [`line`] writes.
fn answer_of(declared: &Declared, text: &[u8]) -> Option<(Vec<f64>, Answer)> {
    let (design, answer) = protocol::stored(declared, text).ok()?;
    (line(declared, &design, &answer).as_bytes() == text).then_some((design, answer))
}

impl Answer {
    fn numbers(&self) -> usize {
        let values: usize = self.values.iter().map(Vec::len).sum();
        values + self.derivatives.iter().flatten().flatten().map(Vec::len).sum::<usize>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn declared() -> Declared {
        let response = |name: &str, is_history| ProgramResponse { name: name.to_owned(), is_history };
        Declared {
            variables: vec!["k".to_owned(), "c".to_owned()],
            times: vec![0.0, 0.5],
            responses: vec![response("a", true), response("m", false)],
        }
    }

    fn answer(x: f64) -> Arc<Answer> {
        let derivatives = Some(vec![vec![vec![x, 0.1 + x], vec![-1e-300, 3.0]], vec![vec![1.0], vec![x / 3.0]]]);
        Arc::new(Answer { values: vec![vec![1.0, x], vec![0.1 * x]], derivatives })
    }

    fn written(count: usize) -> Vec<u8> {
        let mut text = head(&["sh".to_owned()], &declared());
        (0..count).for_each(|k| text += &line(&declared(), &[k as f64 / 3.0, 1e-7], &answer(k as f64 + 0.3)));
        text.into_bytes()
    }

    fn read(text: &[u8]) -> Result<(Answers, u64)> {
        let mut answers = Answers::default();
        let head = head(&["sh".to_owned()], &declared());
        let length = answers.read(&mut &text[..], &head, &declared(), "answers.jsonl")?;
        Ok((answers, length))
    }

    #[test]
    fn lines_are_read_as_they_were_written() {
        let text = written(3);
        let (answers, length) = read(&text).unwrap();
        assert_eq!(length, text.len() as u64);
        for k in 0..3 {
            assert_eq!(answers.at(&[k as f64 / 3.0, 1e-7]), Some(answer(k as f64 + 0.3)));
        }
        assert_eq!(answers.at(&[0.0, 1e-8]), None);
    }

    #[test]
    fn a_cut_line_is_left_out_and_a_changed_one_is_named() {
        let text = written(3);
        let before = written(2).len();
        for cut in before..text.len() {
            assert_eq!(read(&text[..cut]).unwrap().1, before as u64);
        }
        for place in written(1).len()..before {
            let mut text = text.clone();
            text[place] ^= 1;
            let error = read(&text).map(|(_, length)| length).expect_err("a byte has changed").to_string();
            assert!(error.contains("line 3 is damaged") && error.contains("remove the file"), "{error}");
        }
    }

    #[test]
    fn answers_of_another_program_do_not_count() {
        let mut answers = Answers::default();
        let other = head(&["python3".to_owned()], &declared());
        assert_eq!(answers.read(&mut &written(3)[..], &other, &declared(), "answers.jsonl").unwrap(), 0);
        assert!(answers.by_design.is_empty());
    }
}
