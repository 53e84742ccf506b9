//! Slip: how the shear of a drawn contact is spread over it.
//!
//! A contact slides as a whole only when its shear reaches the friction limit. Below it, as in every object that is held, the
//! middle sticks and the shear there is less than its share of the pressure.
//!
//! | name | shear traction |
//! |---|---|
//! | `full` | proportional to the pressure |
//! | a number above 0 and below 1 | partial slip, the shear over the friction limit being that number |
//! | `even` | the same everywhere on the contact |
//! | `mixed` | of ten contacts five `full`, four in partial slip with a number from 0.1 to 1, one `even` |
//! | `held` | of ten contacts three `full`, six in partial slip, one `even`: those of a hand that holds more than it lets slide |
//!
//! The traction is that of [`crate::data::generator`].

use crate::data::frame::Contact;
use crate::random::Random;
use std::fmt::{Display, Formatter};
use std::str::FromStr;

/// Range of shear over the friction limit in partial slip of [`Slip::Mixed`] and [`Slip::Held`].
const LIMITS: [f64; 2] = [0.1, 1.0];
/// Shares of [`Slip::Mixed`]: full slip, partial slip; the rest is even.
const MIXED: [f64; 2] = [0.5, 0.4];
/// The same of [`Slip::Held`].
const HELD: [f64; 2] = [0.3, 0.6];

/// How the shear of a contact is spread.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Slip {
    /// Full slip: proportional to the pressure.
    #[default]
    Full,
    /// Partial slip at this share of the friction limit, above 0 and below 1.
    Partial(f64),
    /// The same everywhere.
    Even,
    /// Full, partial and even, drawn for each contact.
    Mixed,
    /// The same, most of them partial.
    Held,
}

impl Slip {
    /// The columns of tables over the kinds of slip.
    pub const TABLE: [Slip; 6] =
        [Slip::Full, Slip::Partial(0.8), Slip::Partial(0.6), Slip::Partial(0.4), Slip::Partial(0.2), Slip::Even];

    /// One kind of slip: what a mixture draws, else itself.
    fn drawn(self, random: &mut Random) -> Slip {
        let [full, partial] = match self {
            Slip::Mixed => MIXED,
            Slip::Held => HELD,
            own => return own,
        };
        let (kind, limit) = (random.between(0.0, 1.0), random.between(LIMITS[0], LIMITS[1]));
        match kind {
            kind if kind < full => Slip::Full,
            kind if kind < full + partial => Slip::Partial(limit),
            _ => Slip::Even,
        }
    }

    /// The contact, its forces stated, with its shear spread like this.
    pub(super) fn of(self, contact: Contact, random: &mut Random) -> Contact {
        let [x, y] = contact.tangential_N.unwrap_or_default();
        let ratio = x.hypot(y) / contact.normal_N.unwrap_or_default();
        let of = |kind: &str, friction| Contact { kind_of_slip: Some(kind.to_string()), friction, ..contact.clone() };
        match self.drawn(random) {
            Slip::Partial(share) if ratio > 0.0 => of("partial-slip", Some(ratio / share)),
            Slip::Even => of("even-shear", None),
            Slip::Full | Slip::Partial(_) | Slip::Mixed | Slip::Held => contact,
        }
    }
}

impl FromStr for Slip {
    type Err = String;

    fn from_str(name: &str) -> Result<Slip, String> {
        match name {
            "full" => Ok(Slip::Full),
            "even" => Ok(Slip::Even),
            "mixed" => Ok(Slip::Mixed),
            "held" => Ok(Slip::Held),
            number => match number.parse() {
                Ok(share) if share > 0.0 && share < 1.0 => Ok(Slip::Partial(share)),
                _ => Err(format!("{number:?}: allowed are full, even, mixed, held, or a number above 0 and below 1")),
            },
        }
    }
}

impl Display for Slip {
    fn fmt(&self, f: &mut Formatter) -> std::fmt::Result {
        match self {
            Slip::Full => f.write_str("full"),
            Slip::Partial(share) => share.fmt(f),
            Slip::Even => f.write_str("even"),
            Slip::Mixed => f.write_str("mixed"),
            Slip::Held => f.write_str("held"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_and_refused() {
        for slip in Slip::TABLE.into_iter().chain([Slip::Mixed, Slip::Held]) {
            assert_eq!(slip.to_string().parse(), Ok(slip));
        }
        for name in ["", "none", "0", "1", "1.5", "-0.2", "NaN"] {
            assert!(name.parse::<Slip>().unwrap_err().contains("above 0 and below 1"), "{name}");
        }
    }

    /// The shares of the mixtures, within four standard deviations of 4000 draws.
    #[test]
    fn mixtures_have_their_shares() {
        for (mixture, [full, partial]) in [(Slip::Mixed, MIXED), (Slip::Held, HELD)] {
            let mut random = Random::new(3);
            let drawn: Vec<Slip> = (0..4000).map(|_| mixture.drawn(&mut random)).collect();
            let count = |of: fn(&Slip) -> bool| drawn.iter().filter(|slip| of(slip)).count() as f64 / 4000.0;
            assert!((count(|slip| *slip == Slip::Full) - full).abs() < 0.03);
            assert!((count(|slip| *slip == Slip::Even) - 0.1).abs() < 0.02);
            let half = count(|slip| matches!(slip, Slip::Partial(share) if *share < 0.55));
            assert!((half - partial / 2.0).abs() < 0.03, "{half}");
            assert!(drawn.iter().all(|slip| !matches!(slip, Slip::Partial(share) if !(0.1..1.0).contains(share))));
        }
    }
}
