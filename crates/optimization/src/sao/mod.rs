//! The sequence of approximate optimization cycles (Sections 3 and 4 of the paper).
//!
//! A [`Method`] is a choice of interchangeable parts, and its [`Method::step`] does one cycle. All data that change are in
//! one [`RunState`]. It can be written to a file, and a run that continues from the file has the same bits.

mod automatic;
mod confirmation;
mod conservatism;
mod cycle;
mod driver;
mod filter;
mod globalization;
mod method;
mod move_limits;
mod optimality;
mod override_decision;
mod post_optimal;
mod presets;
mod region;
mod screening;
mod state;
mod state_shape;
mod stop_test;
mod trace;
mod trial;
mod trust_region;

pub use automatic::{
    AcceptedPoint, ApproximatedValue, ApproximationKind, Automatic, AutomaticState, FilterEntry, NumberGroup, NumberId,
    RejectedPoint, Scores, StartLengths,
};
pub use conservatism::Conservatism;
pub use cycle::{ActiveRow, Cycle, Prediction};
pub use filter::{Filter, FilteredConservatism};
pub use globalization::{AcceptAlways, ErrorBased, Globalization, GlobalizationState, StayFeasible, StepVerdict};
pub use method::Method;
pub use move_limits::{MoveLimits, RelativeLimits};
pub use post_optimal::{Parameter, PostOptimal};
pub use presets::{DEFAULT_PRESET, Preset, preset, presets};
pub use region::Region;
pub use screening::Screening;
pub use state::{Confirmation, Counters, RunState, STATE_VERSION, Status};
pub use stop_test::Stop;
pub use trial::{Outcome, Trial};
pub use trust_region::{FixedLimits, Merit, TrustRegion};

/// The reason for the end of a run whose approximate problem cannot be evaluated.
const NOT_FINITE: &str = "the approximate problem of the next step is not finite: values, derivatives or steps are near the largest or \
     the least number; change the units, add bounds, or use another method";
