//! The animation as an animated GIF.

use gif::{Encoder, Frame, Repeat};
use rayon::prelude::*;

use super::Animation;
use crate::report::figure::pixels;
use crate::{Error, Result};

/// Shortest duration of a frame in hundredths of a second; viewers slow down faster ones.
const SHORTEST_DELAY: f64 = 4.0;

impl Animation {
    /// The animated GIF, repeated endlessly, at a resolution in pixels per inch; 96 suits a screen.
    ///
    /// It has at most 25 frames per second; other frames are omitted.
    ///
    /// # Errors
    /// [`Error::Option`] for a resolution outside 10 to 2400, [`Error::Definition`] for more than 65 535 pixels along a side.
    pub fn gif(&self, resolution: f64) -> Result<Vec<u8>> {
        let windows = self.windows();
        let stride = (SHORTEST_DELAY * self.times.len() as f64 / (100.0 * self.seconds)).ceil().max(1.0) as usize;
        let delay = (100.0 * self.seconds * stride as f64 / self.times.len() as f64).round().clamp(1.0, 6000.0) as u16;
        let shown: Vec<usize> = (0..self.times.len()).step_by(stride).collect();
        let frames: Vec<Frame> =
            shown.par_iter().map(|&k| self.gif_frame(k, &windows, resolution, delay)).collect::<Result<_>>()?;
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(&mut bytes, frames[0].width, frames[0].height, &[]).map_err(unwritable)?;
        encoder.set_repeat(Repeat::Infinite).map_err(unwritable)?;
        frames.iter().try_for_each(|frame| encoder.write_frame(frame)).map_err(unwritable)?;
        drop(encoder);
        Ok(bytes)
    }

    fn gif_frame(&self, k: usize, windows: &[[f64; 2]; 2], resolution: f64, delay: u16) -> Result<Frame<'static>> {
        let pixmap = pixels(&self.figure(k, windows).svg()?, resolution)?;
        let side = |length: u32| u16::try_from(length).map_err(|_| unwritable(format!("a side has {length} pixels")));
        let (width, height) = (side(pixmap.width())?, side(pixmap.height())?);
        // The background is opaque, so premultiplied and plain colours are equal.
        let mut rgba = pixmap.take();
        const THOROUGH: i32 = 10;
        Ok(Frame { delay, ..Frame::from_rgba_speed(width, height, &mut rgba, THOROUGH) })
    }
}

fn unwritable(why: impl ToString) -> Error {
    Error::definition("GIF animation", why.to_string(), "lower the resolution")
}

#[cfg(test)]
mod tests {
    use super::super::tests::crank;

    #[test]
    fn frames_differ_and_keep_their_time() {
        let bytes = crank(8).lasting(1.6).unwrap().gif(60.0).unwrap();
        let mut options = gif::DecodeOptions::new();
        options.set_color_output(gif::ColorOutput::RGBA);
        let mut decoder = options.read_info(bytes.as_slice()).unwrap();
        assert!((f64::from(decoder.width()) - 150.0 / 25.4 * 60.0).abs() <= 1.0);
        let mut frames = Vec::new();
        while let Some(frame) = decoder.read_next_frame().unwrap() {
            assert_eq!(frame.delay, 20);
            frames.push(frame.buffer.to_vec());
        }
        assert_eq!(frames.len(), 8);
        assert!(frames.windows(2).all(|pair| pair[0] != pair[1]));
    }

    #[test]
    fn fast_frames_are_omitted() {
        let bytes = crank(100).lasting(1.0).unwrap().gif(30.0).unwrap();
        let mut decoder = gif::DecodeOptions::new().read_info(bytes.as_slice()).unwrap();
        let mut count = 0;
        while decoder.read_next_frame().unwrap().is_some() {
            count += 1;
        }
        assert_eq!(count, 25);
        assert!(crank(2).gif(f64::NAN).is_err());
    }
}
