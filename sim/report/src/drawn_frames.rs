//! Frames of random contacts, drawn from a seed: test data that no parameter was tuned on.
//!
//! Frame k takes its number of contacts from `--contacts` in turn and has its own seed; sensor and medium are the
//! scene's.

use anyhow::Result;
use clap::{value_parser, Args, ValueEnum};
use dermis_golden::data::frame::Frame;
use dermis_golden::data::generator::slip::Slip;
use dermis_golden::data::generator::{self, generate, random_contacts, Draw};
use dermis_golden::spec::scene::Scene;

/// Command-line options of the drawn frames.
#[derive(Args, Clone, Debug)]
pub struct DrawnFrames {
    /// Draw N random frames per scene instead of using the shipped ones; 0 uses the shipped ones.
    #[arg(long = "fresh", value_name = "N", default_value_t = 0, value_parser = value_parser!(u32).range(0..=100_000))]
    pub frames: u32,
    /// Number of contacts on a drawn frame, repeatable; successive frames take the values in turn.
    #[arg(long = "contacts", value_name = "K", default_value = "1", value_parser = value_parser!(u8).range(1..=8))]
    pub contacts: Vec<u8>,
    /// Shapes of drawn contacts.
    #[arg(long, value_enum, default_value = "elliptic")]
    pub shapes: Shapes,
    /// Place drawn contacts so that they touch each other.
    #[arg(long)]
    pub touching: bool,
    /// Seed of the random numbers.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
}

/// Shapes of drawn contacts.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shapes {
    /// Ellipses with Hertzian or uniform pressure, full sliding.
    Elliptic,
    /// Rings, rectangles, uniform discs and Hertzian circles in partial slip.
    Other,
}

impl From<Shapes> for generator::Shapes {
    fn from(shapes: Shapes) -> Self {
        match shapes {
            Shapes::Elliptic => generator::Shapes::Elliptic,
            Shapes::Other => generator::Shapes::Other,
        }
    }
}

impl DrawnFrames {
    /// The drawn frames of a scene.
    ///
    /// # Errors
    /// A stress that is not finite.
    pub fn draw(&self, scene: &Scene) -> Result<Vec<Frame>> {
        let frame = |index: usize| -> Result<Frame> {
            let count = usize::from(self.contacts[index % self.contacts.len()]);
            // Spread over 64 bits, so that neighbouring seeds and frames do not share random streams.
            let seed = self.seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ (index as u64) << 32;
            let contacts = random_contacts(
                &scene.sensor,
                Draw { count, shapes: self.shapes.into(), slip: Slip::Full, touching: self.touching, seed },
            );
            Ok(generate(&format!("fresh-{}-{index}", self.seed), &scene.sensor, scene.medium, &contacts)?)
        };
        (0..self.frames as usize).map(frame).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_repeat_and_differ() {
        let scene = Scene::builtin("sensor-3").unwrap();
        let drawn = DrawnFrames { frames: 4, contacts: vec![1, 3], shapes: Shapes::Other, touching: true, seed: 5 };
        let frames = drawn.draw(&scene).unwrap();
        assert_eq!(frames.iter().map(|frame| frame.contacts.len()).collect::<Vec<_>>(), [1, 3, 1, 3]);
        assert_eq!(frames, drawn.draw(&scene).unwrap());
        assert_ne!(frames[0].stress_MPa, frames[2].stress_MPa);
        let other = DrawnFrames { seed: 6, ..drawn }.draw(&scene).unwrap();
        assert_ne!(frames[0].stress_MPa, other[0].stress_MPa);
    }
}
