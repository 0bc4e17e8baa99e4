//! Colours for readers with colour vision deficiency and for grey prints.

/// An sRGB colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Colour(pub u8, pub u8, pub u8);

impl Colour {
    /// Black.
    pub const BLACK: Self = Self(0, 0, 0);
    /// White.
    pub const WHITE: Self = Self(255, 255, 255);
    /// A mid grey for the background.
    pub const GREY: Self = Self(128, 128, 128);
    /// A light grey for fills and move limits.
    pub const LIGHT_GREY: Self = Self(205, 205, 205);
    /// Okabe and Ito's blue.
    pub const BLUE: Self = Self(0, 114, 178);
    /// Okabe and Ito's vermillion.
    pub const VERMILLION: Self = Self(213, 94, 0);
    /// Okabe and Ito's bluish green.
    pub const GREEN: Self = Self(0, 158, 115);
    /// Okabe and Ito's orange.
    pub const ORANGE: Self = Self(230, 159, 0);
    /// Okabe and Ito's reddish purple.
    pub const PURPLE: Self = Self(204, 121, 167);
    /// Okabe and Ito's sky blue.
    pub const SKY: Self = Self(86, 180, 233);

    /// Colour of the `index`-th series: black, then those of Okabe and Ito, dark ones first.
    pub fn of_series(index: usize) -> Self {
        const CYCLE: [Colour; 7] = [
            Colour::BLACK,
            Colour::BLUE,
            Colour::VERMILLION,
            Colour::GREEN,
            Colour::PURPLE,
            Colour::ORANGE,
            Colour::SKY,
        ];
        CYCLE[index % CYCLE.len()]
    }

    /// `#rrggbb`.
    pub fn hex(self) -> String {
        format!("#{:02x}{:02x}{:02x}", self.0, self.1, self.2)
    }

    fn mix(self, other: Self, part: f64) -> Self {
        let channel = |a: u8, b: u8| (f64::from(a) + part * (f64::from(b) - f64::from(a))).round() as u8;
        Self(channel(self.0, other.0), channel(self.1, other.1), channel(self.2, other.2))
    }
}

/// Colour map from `[0, 1]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColourMap {
    /// Dark blue to yellow with increasing lightness, also in grey.
    Sequential,
    /// Blue through white to red, for signed values: `0.5` is white.
    Diverging,
}

impl ColourMap {
    /// The colour at `fraction`, clamped to `[0, 1]`.
    pub fn at(self, fraction: f64) -> Colour {
        const SEQUENTIAL: [Colour; 7] = [
            Colour(0, 32, 76),
            Colour(38, 64, 108),
            Colour(86, 92, 108),
            Colour(124, 123, 120),
            Colour(166, 157, 117),
            Colour(212, 194, 97),
            Colour(255, 233, 69),
        ];
        const DIVERGING: [Colour; 7] = [
            Colour(5, 48, 97),
            Colour(67, 147, 195),
            Colour(178, 212, 232),
            Colour(250, 250, 250),
            Colour(250, 200, 172),
            Colour(214, 96, 77),
            Colour(103, 0, 31),
        ];
        let stops = match self {
            Self::Sequential => &SEQUENTIAL,
            Self::Diverging => &DIVERGING,
        };
        let place = fraction.clamp(0.0, 1.0) * (stops.len() - 1) as f64;
        let below = (place as usize).min(stops.len() - 2);
        stops[below].mix(stops[below + 1], place - below as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maps_hit_their_ends_and_the_sequential_one_brightens() {
        assert_eq!(ColourMap::Diverging.at(0.5), Colour(250, 250, 250));
        assert_eq!(ColourMap::Sequential.at(7.0), Colour(255, 233, 69));
        let luma = |c: Colour| 0.30 * f64::from(c.0) + 0.59 * f64::from(c.1) + 0.11 * f64::from(c.2);
        let lumas: Vec<f64> = (0..=20).map(|k| luma(ColourMap::Sequential.at(k as f64 / 20.0))).collect();
        assert!(lumas.windows(2).all(|pair| pair[1] > pair[0]));
        assert_eq!(Colour::BLUE.hex(), "#0072b2");
    }
}
