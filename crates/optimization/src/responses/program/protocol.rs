//! Requests to a program and its answers.

use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;

/// Version of the protocol, in each request as `linkwright`.
pub const VERSION: u32 = 1;

/// The longest part of a wrong answer that a message shows, in characters.
const SHOWN: usize = 200;

/// A response of a program.
#[derive(Clone, Debug, PartialEq)]
pub struct ProgramResponse {
    /// Name, in requests and answers.
    pub name: String,
    /// `true` for a number at each time point, `false` for one number.
    pub is_history: bool,
}

/// Design variables, time points and responses of the requests to a program.
#[derive(Clone, Debug, PartialEq)]
pub struct Declared {
    /// Names of the design variables, in the order of the design.
    pub variables: Vec<String>,
    /// Time points of the histories.
    pub times: Vec<f64>,
    /// Responses, in the order of the problem.
    pub responses: Vec<ProgramResponse>,
}

impl Declared {
    /// The number of values of a response.
    pub fn points(&self, response: &ProgramResponse) -> usize {
        if response.is_history { self.times.len() } else { 1 }
    }
}

/// A request: one line of JSON.
#[derive(Serialize)]
pub struct Request<'a> {
    linkwright: u32,
    id: u64,
    design: BTreeMap<&'a str, f64>,
    times: &'a [f64],
    responses: Vec<&'a str>,
    derivatives: bool,
}

/// The numbers of an answer.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// `values[h][p]`: response h at time point p.
    pub values: Vec<Vec<f64>>,
    /// `derivatives[h][i][p]`: ∂r_h/∂b_i at time point p, if the program gave them.
    pub derivatives: Option<Vec<Vec<Vec<f64>>>>,
}

/// Reason why a line is not an answer.
#[derive(Clone, Debug, PartialEq)]
pub enum Refusal {
    /// The program says that it cannot analyse this design.
    Failed(String),
    /// The line breaks the protocol.
    Broken(String),
}

#[derive(Deserialize)]
struct ProtocolLine {
    id: Option<u64>,
    error: Option<String>,
    design: Option<BTreeMap<String, f64>>,
    responses: Option<BTreeMap<String, Value>>,
    derivatives: Option<BTreeMap<String, BTreeMap<String, Value>>>,
}

/// The line of a request, with the line feed.
pub fn request(declared: &Declared, id: u64, design: &[f64], derivatives: bool) -> Vec<u8> {
    let request = Request {
        linkwright: VERSION,
        id,
        design: declared.variables.iter().map(String::as_str).zip(design.iter().copied()).collect(),
        times: &declared.times,
        responses: declared.responses.iter().map(|response| response.name.as_str()).collect(),
        derivatives,
    };
    let mut line = serde_json::to_vec(&request).expect("numbers and names are JSON");
    line.push(b'\n');
    line
}

/// The longest line that an answer with derivatives can need, in bytes.
pub fn longest(declared: &Declared) -> usize {
    let numbers: usize = declared.responses.iter().map(|response| declared.points(response)).sum();
    (1 << 20) + 64 * numbers * (1 + declared.variables.len())
}

/// Reads the answer to the request `id` at a design.
///
/// # Errors
/// [`Refusal`], if the program reports a failure or the line is not an answer to this request: no JSON, another `id` or design, a response
/// that is missing, unknown or of the wrong length, a number that is not finite.
pub fn answer(declared: &Declared, id: u64, design: &[f64], line: &[u8]) -> Result<Answer, Refusal> {
    let broken = |why: String| Refusal::Broken(why);
    let shown = || format!("`{}`", shown(line));
    let line: ProtocolLine = serde_json::from_slice(line).map_err(|why| {
        broken(format!("it answered {}, which is not an answer ({why}); NaN and Infinity are not JSON", shown()))
    })?;
    if line.id != Some(id) {
        return Err(broken(format!("it answered {} to the request with the id {id}", shown())));
    }
    if let Some(why) = line.error {
        return Err(Refusal::Failed(self::shown(why.as_bytes())));
    }
    for (name, value) in line.design.iter().flatten() {
        let place = declared.variables.iter().position(|variable| variable == name);
        if place.is_none_or(|i| design[i].to_bits() != value.to_bits()) {
            return Err(broken(format!("it answered another design: {name} = {value}")));
        }
    }
    if line.responses.is_none() {
        return Err(broken(format!("its answer {} has no `responses`", shown())));
    }
    line.answer(declared).map_err(broken)
}

/// The design and the answer in a line that has both.
///
/// # Errors
/// The reason in words, if the line lacks one of them or a number is missing.
pub fn stored(declared: &Declared, line: &[u8]) -> Result<(Vec<f64>, Answer), String> {
    let line: ProtocolLine = serde_json::from_slice(line).map_err(|why| why.to_string())?;
    let design = line.design.as_ref().ok_or("it has no `design`")?;
    let value = |name: &String| design.get(name).copied().ok_or_else(|| format!("its design has no `{name}`"));
    let design = declared.variables.iter().map(value).collect::<Result<_, String>>()?;
    Ok((design, line.answer(declared)?))
}

impl ProtocolLine {
    /// The numbers that were asked for.
    fn answer(self, declared: &Declared) -> Result<Answer, String> {
        let given = self.responses.unwrap_or_default();
        if let Some(name) = given.keys().find(|name| declared.responses.iter().all(|known| known.name != **name)) {
            return Err(format!("it answered a response `{name}`, which was not asked for"));
        }
        let values = declared
            .responses
            .iter()
            .map(|response| {
                let name = &response.name;
                let value = given.get(name).ok_or_else(|| format!("its answer has no response `{name}`"))?;
                numbers(value, declared.points(response), response.is_history)
                    .map_err(|why| format!("response `{name}`: {why}"))
            })
            .collect::<Result<_, String>>()?;
        let derivatives = self.derivatives.map(|given| derivatives(declared, &given)).transpose()?;
        Ok(Answer { values, derivatives })
    }
}

fn derivatives(
    declared: &Declared,
    given: &BTreeMap<String, BTreeMap<String, Value>>,
) -> Result<Vec<Vec<Vec<f64>>>, String> {
    let of = |response: &ProgramResponse, variable: &String| {
        let name = &response.name;
        let value = given.get(name).and_then(|of_response| of_response.get(variable));
        let value = value.ok_or_else(|| format!("`derivatives` has no entry `{name}`, `{variable}`"))?;
        numbers(value, declared.points(response), response.is_history)
            .map_err(|why| format!("derivative of `{name}` with respect to `{variable}`: {why}"))
    };
    declared
        .responses
        .iter()
        .map(|response| declared.variables.iter().map(|variable| of(response, variable)).collect())
        .collect()
}

fn numbers(value: &Value, expected: usize, is_history: bool) -> Result<Vec<f64>, String> {
    let number = |value: &Value| match value.as_f64() {
        Some(number) if number.is_finite() => Ok(number),
        _ => Err(format!("`{}` is not a number", shown(value.to_string().as_bytes()))),
    };
    match value {
        Value::Array(values) if is_history => {
            if values.len() != expected {
                return Err(format!("{} numbers for {expected} time points", values.len()));
            }
            values.iter().map(number).collect()
        }
        _ if is_history => Err(format!("a list of {expected} numbers was expected, one for each time point")),
        _ => Ok(vec![number(value)?]),
    }
}

/// The beginning of a text, control characters replaced.
pub fn shown(bytes: &[u8]) -> String {
    let text = String::from_utf8_lossy(bytes);
    let mut shown: String = text.trim_end().chars().take(SHOWN).map(|c| if c.is_control() { '␣' } else { c }).collect();
    if text.trim_end().chars().nth(SHOWN).is_some() {
        shown.push('…');
    }
    shown
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

    fn read(line: &str) -> Result<Answer, Refusal> {
        answer(&declared(), 7, &[0.5, 2.0], line.as_bytes())
    }

    #[test]
    fn a_request_is_one_line() {
        let line = String::from_utf8(request(&declared(), 7, &[0.5, 2.0], true)).unwrap();
        let expected = r#"{"linkwright":1,"id":7,"design":{"c":2.0,"k":0.5},"times":[0.0,0.5],"responses":["a","m"],"derivatives":true}"#;
        assert_eq!(line, format!("{expected}\n"));
    }

    #[test]
    fn answers_are_read_by_name() {
        let found = read(r#"{"id":7,"responses":{"m":3,"a":[1,2.5]}}"#).unwrap();
        assert_eq!(found, Answer { values: vec![vec![1.0, 2.5], vec![3.0]], derivatives: None });
        let found = read(
            r#"{"id":7,"responses":{"m":3,"a":[1,2]},"derivatives":{"a":{"c":[1,2],"k":[3,4]},"m":{"k":5,"c":6}}}"#,
        );
        let expected = vec![vec![vec![3.0, 4.0], vec![1.0, 2.0]], vec![vec![5.0], vec![6.0]]];
        assert_eq!(found.unwrap().derivatives, Some(expected));
    }

    #[test]
    fn what_is_no_answer_is_named() {
        assert_eq!(read(r#"{"id":7,"error":"no assembly"}"#), Err(Refusal::Failed("no assembly".to_owned())));
        for (line, part) in [
            ("hello\u{1b}[2J", "`hello␣[2J`, which is not an answer"),
            (r#"{"id":7,"responses":{"m":NaN,"a":[1,2]}}"#, "NaN and Infinity are not JSON"),
            (r#"{"id":8,"responses":{"m":3,"a":[1,2]}}"#, "the request with the id 7"),
            (r#"{"id":7,"design":{"k":0.4},"responses":{"m":3,"a":[1,2]}}"#, "another design: k = 0.4"),
            (r#"{"id":7}"#, "has no `responses`"),
            (r#"{"id":7,"responses":{"m":3}}"#, "no response `a`"),
            (r#"{"id":7,"responses":{"m":3,"a":[1,2],"b":1}}"#, "a response `b`, which was not asked for"),
            (r#"{"id":7,"responses":{"m":3,"a":[1,2,3]}}"#, "response `a`: 3 numbers for 2 time points"),
            (r#"{"id":7,"responses":{"m":3,"a":5}}"#, "a list of 2 numbers"),
            (r#"{"id":7,"responses":{"m":[3],"a":[1,2]}}"#, "response `m`: `[3]` is not a number"),
            (r#"{"id":7,"responses":{"m":1e999,"a":[1,2]}}"#, "is not an answer"),
            (r#"{"id":7,"responses":{"m":3,"a":[1,2]},"derivatives":{"m":{"k":5}}}"#, "no entry `a`, `k`"),
        ] {
            match read(line) {
                Err(Refusal::Broken(why)) => assert!(why.contains(part), "{why}"),
                other => panic!("{line}: {other:?}"),
            }
        }
    }
}
