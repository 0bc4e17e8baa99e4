//! Pseudo-random numbers that are the same in every version.

/// The increment of the state: 2⁶⁴ divided by the golden ratio.
const INCREMENT: u64 = 0x9e37_79b9_7f4a_7c15;

/// The SplitMix64 generator.
///
/// # Sources
///
/// G. L. Steele, D. Lea and C. H. Flood, *Fast splittable pseudorandom number generators*, OOPSLA 2014, 453–472.
pub(super) struct SplitMix64 {
    state: u64,
}

impl SplitMix64 {
    pub fn new(seed: u64) -> Self {
        Self { state: seed }
    }

    /// The generator after `count` numbers.
    pub fn after(self, count: u64) -> Self {
        Self { state: self.state.wrapping_add(count.wrapping_mul(INCREMENT)) }
    }

    pub fn bits(&mut self) -> u64 {
        let bits = mixed(self.state);
        self.state = self.state.wrapping_add(INCREMENT);
        bits
    }

    /// A number in [from, to).
    pub fn within(&mut self, [from, to]: [f64; 2]) -> f64 {
        from + (to - from) * (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Pseudo-random bits that depend on all given bits: a step of SplitMix64.
pub(super) fn mixed(bits: u64) -> u64 {
    let mut z = bits.wrapping_add(INCREMENT);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// A number in [−1, 1) from bits.
pub(super) fn symmetric(bits: u64) -> f64 {
    2.0 * (bits >> 11) as f64 / (1u64 << 53) as f64 - 1.0
}
