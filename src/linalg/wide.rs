//! The widest vector registers that the processor has.

/// Does `work` with the widest vector registers of the processor that it runs on.
///
/// What is inlined into `work` is compiled for them as well as for any processor; which version runs is found out once.
/// Numbers are rounded alike in all of them: no product is fused with a sum.
#[inline(always)]
pub(crate) fn widely<R>(work: impl FnOnce() -> R) -> R {
    pulp::Arch::new().dispatch(work)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounds_as_any_processor_does() {
        let values: Vec<f64> = (0..37).map(|i| (1.7 * i as f64).sin()).collect();
        let sums = |values: &[f64]| -> Vec<f64> { values.iter().map(|x| 0.1 + x * 0.3).collect() };
        assert_eq!(widely(|| sums(&values)), sums(&values));
    }
}
