//! Names and sizes that requests to a program and its answers refer to.

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
