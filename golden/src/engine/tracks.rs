//! Tracks: contacts with a number that stays with them from result to result.
//!
//! Contacts of two results are the same where they are nearest: pairs in the order of their distance, each once, up to [`REACH`]. So of a
//! contact that splits the nearer part keeps the number, and two that join keep that of the nearer one. A contact that has not been
//! found in [`GAP`] results has ended.
//!
//! | | unit |
//! |---|---|
//! | in: results in their order | – |
//! | out: number, age, place, velocity of each contact | –, results, mm, mm per result |
//! | out: load ratio, its largest value before the contact last began to move | – |

use crate::result::reconstruct::{ContactTrack, FoundContact, Reconstruction};
use crate::spec::sensor::Sensor;

/// Largest way from one result to the next, in thicknesses or pitches, the larger of both.
const REACH: f64 = 2.0;
/// Number of results after which a contact that is not found has ended.
const GAP: u64 = 8;
/// Results over which the velocity is a mean.
const SMOOTH: f64 = 16.0;
/// Results in which the pressure of a new contact grows: before that it does not count as one that slips.
const GROWN: u64 = 32;

/// The contacts of a stream so far.
#[derive(Clone, Debug, Default)]
pub(super) struct Tracks {
    all: Vec<Track>,
    /// Number of the last new contact.
    last: u64,
    /// Number of results.
    results: u64,
}

#[derive(Clone, Debug)]
struct Track {
    shown: ContactTrack,
    /// The result in which it was last found.
    found: u64,
    /// Largest load ratio since it last began to move.
    largest: f64,
}

impl Tracks {
    /// Adds the contacts of a result, and to the result what is known of them.
    pub(super) fn follow(&mut self, sensor: &Sensor, result: &mut Reconstruction) {
        self.results += 1;
        let (now, reach_mm) = (self.results, REACH * sensor.thickness_mm.max(sensor.pitch_x_mm).max(sensor.pitch_y_mm));
        self.all.retain(|track| now - track.found <= GAP);
        let found = result.all_contacts();
        let placed: Vec<(&FoundContact, [f64; 2])> =
            found.iter().filter_map(|contact| Some((contact, contact.centre_mm?))).collect();
        let away = |track: &Track, [x, y]: [f64; 2]| (track.shown.centre_mm[0] - x).hypot(track.shown.centre_mm[1] - y);
        let mut pairs: Vec<(f64, usize, usize)> = (0..self.all.len())
            .flat_map(|track| (0..placed.len()).map(move |contact| (track, contact)))
            .map(|(track, contact)| (away(&self.all[track], placed[contact].1), track, contact))
            .filter(|(away_mm, ..)| *away_mm <= reach_mm)
            .collect();
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut of_contact: Vec<Option<usize>> = vec![None; placed.len()];
        for (_, track, contact) in pairs {
            if of_contact[contact].is_none() && !of_contact.contains(&Some(track)) {
                of_contact[contact] = Some(track);
            }
        }
        let moving = result.extra.template.map(|template| !template.held);
        result.extra.tracks = Vec::with_capacity(placed.len());
        for ((contact, centre_mm), track) in std::iter::zip(placed, of_contact) {
            let index = track.unwrap_or_else(|| {
                self.last += 1;
                self.all.push(Track::new(self.last, centre_mm));
                self.all.len() - 1
            });
            let track = &mut self.all[index];
            track.next(contact, centre_mm, moving);
            track.found = now;
            result.extra.tracks.push(track.shown.clone());
        }
    }
}

impl Track {
    fn new(number: u64, centre_mm: [f64; 2]) -> Track {
        let shown = ContactTrack {
            number,
            age: 0,
            centre_mm,
            velocity_mm: [0.0; 2],
            moving: None,
            load_ratio: 0.0,
            load_ratio_sigma: None,
            slip_ratio: None,
        };
        Track { shown, found: 0, largest: 0.0 }
    }

    fn next(&mut self, contact: &FoundContact, centre_mm: [f64; 2], moving: Option<bool>) {
        let shown = &mut self.shown;
        shown.age += 1;
        for (velocity_mm, (now, before)) in shown.velocity_mm.iter_mut().zip(std::iter::zip(centre_mm, shown.centre_mm))
        {
            *velocity_mm += (now - before - *velocity_mm) / SMOOTH;
        }
        shown.centre_mm = centre_mm;
        let [x, y, normal] = contact.force_N;
        shown.load_ratio = if normal > 0.0 { x.hypot(y) / normal } else { 0.0 };
        shown.load_ratio_sigma = contact.mu_sigma.map(|[x, y]| x.hypot(y) / f64::sqrt(2.0));
        let begins = shown.moving == Some(false) && moving == Some(true) && shown.age > GROWN;
        if begins {
            (shown.slip_ratio, self.largest) = (Some(self.largest), 0.0);
        }
        // While it moves, the ratio is that of kinetic friction.
        if moving == Some(false) {
            self.largest = self.largest.max(shown.load_ratio);
        }
        shown.moving = moving;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::generator::presses::{Motion, Press};
    use crate::engine::{CheckPace, StreamChecks};
    use crate::estimate::float::Golden;
    use crate::spec::scene::{EstimatorKind, MeanKind, Scene};

    fn tracks(scene: &Scene, estimator: EstimatorKind, press: &Press, number: u64) -> Vec<Vec<ContactTrack>> {
        let engine = Golden::with(scene, estimator).unwrap();
        let mut checks = StreamChecks::new(&engine, CheckPace::Never);
        let frames = press.frames(scene, number).unwrap();
        let next = |frame| checks.next(&engine, std::slice::from_ref(frame)).unwrap().extra.tracks;
        frames.iter().map(next).collect()
    }

    #[test]
    fn a_second_contact_has_a_number_of_its_own_and_the_first_keeps_its() {
        let scene = Scene::builtin("eight-by-eight").unwrap();
        let of = |motion| Press { rate_Hz: 20.0, ..Press::new(motion) }.of_frames(12, 1e-3);
        let all = tracks(&scene, EstimatorKind::Evidence, &of(Motion::Second), 3);
        let numbers = |tracks: &[ContactTrack]| {
            let mut numbers: Vec<u64> = tracks.iter().map(|track| track.number).collect();
            numbers.sort_unstable();
            numbers
        };
        assert!(all[..6].iter().all(|tracks| numbers(tracks) == [1]) && all[6..].iter().all(|t| numbers(t) == [1, 2]));
        let first = all[11].iter().find(|track| track.number == 1).unwrap();
        assert_eq!((first.age, first.moving, first.slip_ratio), (12, None, None));
        // Another contact in its place is another one.
        let all = tracks(&scene, EstimatorKind::Evidence, &of(Motion::Jump), 3);
        assert_eq!((numbers(&all[0]), numbers(&all[11])), (vec![1], vec![2]));
    }

    /// A slide that holds first: the way of 0.2 mm is seen within 16 ms at 1 % of noise, the velocity is that of the contact, and the
    /// ratio before it is kept.
    #[test]
    fn a_slide_is_seen_soon_and_the_ratio_before_it_is_kept() {
        let mut scene = Scene::builtin("sensor-1-noisy").unwrap();
        scene.input.mean = MeanKind::Adaptive;
        // A press that holds for 0.3 s and then slides for 0.2 s.
        let slides = |number: u64| -> Option<Press> {
            let coarse =
                Press { frames: 101, rate_Hz: 100.0, ..Press::new(Motion::Slide) }.exact(&scene, number).unwrap();
            let moves = (1..101).find(|k| coarse[*k].contacts != coarse[k - 1].contacts)?;
            let frames = 10 * (100 - moves) + 301;
            (frames < 800).then(|| Press { frames, ..Press::new(Motion::Slide) }.with_noise(0.01))
        };
        let (number, press) = (0..20).find_map(|number| Some((number, slides(number)?))).unwrap();
        let begins = 300;
        let all = tracks(&scene, EstimatorKind::Network, &press, number);
        let moving = |k: usize| all[k][0].moving == Some(true);
        let alarms = (begins - 100..begins).filter(|k| moving(*k)).count();
        let way = (0.2 / 0.02) as usize;
        assert!(alarms <= 2, "{alarms} of 100 still frames move");
        assert!((begins..begins + way + 16).any(moving), "{begins}");
        let last = &all[all.len() - 1][0];
        let speed = last.velocity_mm[0].hypot(last.velocity_mm[1]);
        assert!((speed / 0.02 - 1.0).abs() < 0.4, "{speed} mm");
        let ratio = last.slip_ratio.unwrap();
        assert!(last.number == 1 && ratio > 0.1 && ratio < 0.7, "{ratio}");
    }
}
