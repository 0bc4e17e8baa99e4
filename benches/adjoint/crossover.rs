//! Cost of derivatives over the number of design variables, for the same mechanism and responses.

use crate::cpu::in_turns;
use crate::models::{Cantilever, First, Manipulator};
use linkwright::cases::Chain;
use linkwright::mechanics::analyses::dynamics::Dynamics;
use linkwright::mechanics::analyses::statics::Statics;
use linkwright::mechanics::derivatives::method::Differentiation;
use linkwright::mechanics::initial_conditions::Assembly;
use linkwright::mechanics::integrators::explicit::{Explicit, StepControl};
use linkwright::problem::{Analysis, ResponseAt};
use linkwright::report::figure::{Colour, Figure, Mark, Panel, PlotAxis, Stroke};
use linkwright::responses::mechanism::{Integration, KinematicResponses, StaticResponses, Transient};
use std::path::PathBuf;

/// Numbers of design variables, out of 64.
const VARIABLES: [usize; 7] = [1, 2, 4, 8, 16, 32, 64];

/// Cost of derivatives for one number of design variables, in analyses.
struct Cost {
    variables: usize,
    direct: f64,
    /// For one response at a time point, and for four.
    adjoint: [f64; 2],
}

/// An analysis with the responses to differentiate.
struct Case<F> {
    name: &'static str,
    all: Vec<f64>,
    /// Builds the analysis for a method of differentiation.
    make: F,
    wanted: [Vec<ResponseAt>; 2],
}

pub fn all() {
    let chain = || Chain { energies: false, ..Chain::horizontal(32) };
    let ends = |steps: Integration| {
        move |method| {
            let model = First { model: chain(), all: chain().equal_links() };
            Transient::new(model, steps.clone(), &super::TIMES).unwrap().differentiating(method).unwrap()
        }
    };
    let at_end = || [response_points(1, &[3]), response_points(2, &[2, 3])];
    let times: Vec<f64> = (0..10).map(|k| 0.1 * f64::from(k)).collect();
    let everywhere = || [1, 4].map(|count| response_points(count, &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9]));
    let implicit = ends(Integration::Implicit(Dynamics::fixed(2.5e-4)));
    let explicit = ends(Integration::Explicit(Explicit::eighth_order(1.0).with_step_control(StepControl::Fixed(1e-3))));
    let heights = vec![0.02; 64];
    let sag = |method| {
        let model = First { model: Cantilever, all: vec![0.02; 64] };
        StaticResponses::new(model, Statics::default(), &times).unwrap().differentiating(method).unwrap()
    };
    let links: Vec<f64> = (0..64).map(|k| if k < 32 { 0.1 } else { 1.0 }).collect();
    let turn = |method| {
        let model = First { model: Manipulator, all: links.clone() };
        KinematicResponses::new(model, Assembly::default(), &times).unwrap().differentiating(method).unwrap()
    };
    let chain = chain().equal_links();
    let curves = [
        Case { name: "implicit steps", all: chain.clone(), make: implicit, wanted: at_end() }.costs(),
        Case { name: "explicit steps", all: chain, make: explicit, wanted: at_end() }.costs(),
        Case { name: "equilibria", all: heights, make: sag, wanted: everywhere() }.costs(),
        Case { name: "kinematics", all: links.clone(), make: turn, wanted: everywhere() }.costs(),
    ];
    write(&curves);
}

fn response_points(responses: usize, points: &[usize]) -> Vec<ResponseAt> {
    let at = |&point: &usize| (0..responses).map(move |response| ResponseAt { response, point });
    points.iter().flat_map(at).collect()
}

impl<A: Analysis, F: Fn(Differentiation) -> A> Case<F> {
    /// Measures the cost of derivatives after an analysis.
    fn costs(self) -> (&'static str, Vec<Cost>) {
        let [direct, adjoint] = [Differentiation::Direct, Differentiation::Adjoint].map(&self.make);
        println!("| {}: design variables | direct | adjoint, 1 response | adjoint, 4 responses |", self.name);
        println!("|---|---|---|---|");
        let cost = |variables: usize| {
            let b = &self.all[..variables];
            let responses = direct.analyze(b).unwrap();
            let spend = |analysis: &A, k: usize| drop(analysis.sensitivities(b, &responses, &self.wanted[k]).unwrap());
            let [unit, forward, one, four] = in_turns(
                2,
                [
                    &mut || drop(direct.analyze(b).unwrap()),
                    &mut || spend(&direct, 0),
                    &mut || spend(&adjoint, 0),
                    &mut || spend(&adjoint, 1),
                ],
            );
            let cost = Cost { variables, direct: forward / unit, adjoint: [one / unit, four / unit] };
            println!("| {variables} | {:.2} | {:.2} | {:.2} |", cost.direct, cost.adjoint[0], cost.adjoint[1]);
            cost
        };
        (self.name, VARIABLES.into_iter().map(cost).collect())
    }
}

/// Writes the table and the figure.
fn write(curves: &[(&'static str, Vec<Cost>)]) {
    let folder = std::env::var_os("ADJOINT_FIGURE").map_or_else(|| PathBuf::from("target"), PathBuf::from);
    let mut table = String::from("analysis,design variables,direct,adjoint 1 response,adjoint 4 responses\n");
    let mut figure = Figure::new("Cost of derivatives over the number of design variables", 170.0, 120.0).in_columns(2);
    for (name, costs) in curves {
        for Cost { variables, direct, adjoint: [one, four] } in costs {
            table += &format!("{name},{variables},{direct:.3},{one:.3},{four:.3}\n");
        }
        let axes =
            [PlotAxis::new("design variables", "").logarithmic(), PlotAxis::new("cost", "analyses").logarithmic()];
        let [x, y] = axes;
        let mut panel = Panel::new(x, y).titled(*name);
        let curve = |of: fn(&Cost) -> f64| costs.iter().map(|c| [c.variables as f64, of(c)]).collect::<Vec<_>>();
        panel.add(Mark::curve(curve(|c| c.direct), Stroke::solid(Colour::BLUE, 1.0)).named("direct"));
        let adjoint = [("adjoint, 1 response", Colour::VERMILLION), ("adjoint, 4 responses", Colour::ORANGE)];
        let of: [fn(&Cost) -> f64; 2] = [|c| c.adjoint[0], |c| c.adjoint[1]];
        for ((name, colour), of) in adjoint.into_iter().zip(of) {
            panel.add(Mark::curve(curve(of), Stroke::solid(colour, 1.0)).named(name));
        }
        figure = figure.with(panel);
    }
    std::fs::write(folder.join("crossover.csv"), table).unwrap();
    std::fs::write(folder.join("crossover.svg"), figure.svg().unwrap()).unwrap();
}
