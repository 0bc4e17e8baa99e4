//! Propagation of derivatives along the steps of an analysis.
//!
//! A [`StepSource`] advances the analysis, or reads its recording, and linearizes its steps once for all design
//! variables. A [`StepConsumer`] propagates the derivatives for a few design variables along these steps. [`propagate`]
//! connects them, with the same bits for any number of threads.

use crate::Result;
use rayon::prelude::*;

/// Source of the converged steps of an analysis, in blocks.
pub(crate) trait StepSource: Send {
    /// Consecutive steps with the data for their derivatives.
    type Block: Send + Sync;

    /// Storage for one block.
    fn block(&mut self) -> Self::Block;

    /// Overwrites `block` with the next steps. Returns `false` at the end of the analysis.
    fn fill(&mut self, block: &mut Self::Block) -> Result<bool>;
}

/// Derivatives with respect to a few design variables that are propagated along the steps of an analysis.
pub(crate) trait StepConsumer<B>: Send {
    /// Propagates the derivatives along the steps of `block`, and records those of the outputs that these reach.
    fn propagate(&mut self, block: &B) -> Result<()>;
}

/// Distribution of the work over threads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Schedule {
    /// One thread, without any allocation.
    Sequential,
    /// The consumers of a block in parallel.
    Parallel,
    /// The consumers of a block in parallel with each other and with the source, which fills the next block.
    Overlapped,
}

/// Propagates the derivatives of all `consumers` to the end of the analysis.
///
/// # Errors
/// The first error of the source or of a consumer.
pub(crate) fn propagate<S: StepSource, C: StepConsumer<S::Block>>(
    source: &mut S,
    consumers: &mut [C],
    schedule: Schedule,
) -> Result<()> {
    match schedule {
        Schedule::Sequential => {
            let mut block = source.block();
            while source.fill(&mut block)? {
                consumers.iter_mut().try_for_each(|consumer| consumer.propagate(&block))?;
            }
            Ok(())
        }
        // The pool is entered once: that is cheaper than once per block.
        Schedule::Parallel => rayon::scope(|_| {
            let mut block = source.block();
            while source.fill(&mut block)? {
                consume(consumers, &block)?;
            }
            Ok(())
        }),
        Schedule::Overlapped => rayon::scope(|_| {
            let (mut current, mut next) = (source.block(), source.block());
            let mut is_filled = source.fill(&mut current)?;
            while is_filled {
                let (consumed, filled) = rayon::join(|| consume(consumers, &current), || source.fill(&mut next));
                consumed?;
                is_filled = filled?;
                std::mem::swap(&mut current, &mut next);
            }
            Ok(())
        }),
    }
}

/// Propagates the derivatives of all consumers along `block`. Of several errors it returns that of the first consumer, not
/// that of the fastest thread.
fn consume<B: Sync, C: StepConsumer<B>>(consumers: &mut [C], block: &B) -> Result<()> {
    consumers.par_iter_mut().map(|consumer| consumer.propagate(block)).reduce(|| Ok(()), Result::and)
}
