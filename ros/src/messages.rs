//! Results as messages of ROS 2, and the definitions of all messages.

use std::fmt::Write;
use std::path::Path;

use anyhow::{anyhow, Context, Result};
use dermis_golden::data::recording::frame_messages;
use dermis_golden::data::recording::message::{
    Contact, Contacts, Definition, DiagnosticArray, Empty, Header, Image, MarkerArray, Message, PointCloud2, Text,
    TfMessage, Transform, TransformStamped, Wrench, WrenchStamped,
};
use dermis_golden::result::reconstruct::{ContactTrack, FoundContact, Reconstruction};
use dermis_golden::spec::scene::Scene;
use dermis_golden::spec::sensor::Sensor;
use dermis_host::recording::{header, torque, Arrows, Points, METRES};
use dermis_host::stream::StreamAnswer;

use crate::patches::{Patch, Pose};

/// Makes the messages of a patch.
pub struct Messages {
    name: String,
    frame_id: String,
    sensor: Sensor,
    arrows: Arrows,
}

/// A message in CDR.
fn cdr<M: Message>(message: &M) -> Result<Vec<u8>> {
    message.to_cdr().map_err(|error| anyhow!("{}: {error}", M::NAME))
}

impl Messages {
    /// Those of a patch.
    pub fn new(patch: &Patch) -> Messages {
        let Scene { sensor, .. } = &patch.scene;
        let (name, frame_id) = (patch.fields.name.clone(), patch.frame_id.clone());
        Messages { name, frame_id, sensor: sensor.clone(), arrows: Arrows::of(&patch.scene) }
    }

    fn header(&self, answer: &StreamAnswer) -> Header {
        header(&self.frame_id, answer.time_ns())
    }

    /// Force and torque about the array's centre.
    ///
    /// # Errors
    /// A name that CDR cannot represent, as of all messages.
    pub fn wrench(&self, answer: &StreamAnswer) -> Result<Vec<u8>> {
        let wrench = Wrench { force: answer.result.resultant_N, torque: whole_torque(answer.result) };
        cdr(&WrenchStamped { header: self.header(answer), wrench })
    }

    /// The contacts with their numbers.
    ///
    /// # Errors
    /// As [`Messages::wrench`].
    pub fn contacts(&self, answer: &StreamAnswer) -> Result<Vec<u8>> {
        let result = answer.result;
        let found = result.all_contacts();
        let placed = found.iter().filter_map(|own| Some((own, own.centre_mm?)));
        // A track per contact with a place, in the same order.
        let contacts = placed.enumerate().map(|(index, own)| contact(own, result.extra.tracks.get(index)));
        cdr(&Contacts {
            header: self.header(answer),
            name: self.name.clone(),
            estimator: answer.estimator.to_owned(),
            flags: result.flags.iter().map(|flag| flag.name().to_owned()).collect(),
            contacts: contacts.collect(),
        })
    }

    /// The forces as arrows and lines.
    ///
    /// # Errors
    /// As [`Messages::wrench`].
    pub fn arrows(&self, answer: &StreamAnswer) -> Result<Vec<u8>> {
        let contacts = answer.result.all_contacts();
        cdr(&self.arrows.markers(&self.sensor, answer.result, &contacts, &self.header(answer)))
    }

    /// The forces of the taxels; `None` of a result that has none.
    ///
    /// # Errors
    /// As [`Messages::wrench`].
    pub fn forces(&self, answer: &StreamAnswer) -> Result<Option<Vec<u8>>> {
        if answer.result.forces_N.fz.is_empty() {
            return Ok(None);
        }
        let points = Points::new(&self.sensor, answer.result);
        cdr(&points.cloud(&self.sensor, self.header(answer))).map(Some)
    }

    /// The newest frame.
    ///
    /// # Errors
    /// As [`Messages::wrench`].
    pub fn stress(&self, answer: &StreamAnswer) -> Result<Option<Vec<u8>>> {
        let shape = [self.sensor.rows, self.sensor.cols];
        let Some(frame) = answer.frames.last() else { return Ok(None) };
        let [_, (_, single)] = frame_messages(shape, &self.header(answer), &frame.readings())?;
        Ok(Some(single))
    }
}

/// Torque about the array's centre in N·m.
fn whole_torque(result: &Reconstruction) -> [f64; 3] {
    if let Some(wrench) = result.extra.wrench {
        return wrench.moment_Nmm.map(|moment| moment * METRES);
    }
    // Of resultants alone.
    let own = |own: FoundContact| own.centre_mm.map(|centre_mm| torque(centre_mm, own.force_N));
    let all = result.all_contacts().into_iter().filter_map(own);
    all.fold([0.0; 3], |sum, own| [0, 1, 2].map(|axis| sum[axis] + own[axis]))
}

fn contact((found, [x, y]): (&FoundContact, [f64; 2]), track: Option<&ContactTrack>) -> Contact {
    let [shear_x, shear_y, normal_force] = found.force_N;
    let [sigma_x, sigma_y] = found.shear_sigma_N.unwrap_or([f64::NAN; 2]);
    let moving = match track.and_then(|track| track.moving) {
        None => Contact::MOVING_UNKNOWN,
        Some(false) => Contact::MOVING_NO,
        Some(true) => Contact::MOVING_YES,
    };
    Contact {
        number: track.map_or(0, |track| track.number),
        age: track.map_or(0, |track| track.age),
        position: [x * METRES, y * METRES, 0.0],
        normal_force,
        shear: [shear_x, shear_y],
        sigma: [sigma_x, sigma_y, found.normal_sigma_N.unwrap_or(f64::NAN)],
        load_ratio: track.map_or(f64::NAN, |track| track.load_ratio),
        load_ratio_sigma: track.and_then(|track| track.load_ratio_sigma).unwrap_or(f64::NAN),
        moving,
    }
}

/// The places of all patches that have one, at this time in ns since 1970.
///
/// # Errors
/// As [`Messages::wrench`].
pub fn places(patches: &[Patch], time_ns: i64) -> Result<Option<Vec<u8>>> {
    let place = |patch: &Patch| {
        let pose: &Pose = patch.fields.pose.as_ref()?;
        let transform = Transform { translation: pose.xyz_m, rotation: pose.quaternion() };
        let header = header(&pose.parent, time_ns);
        Some(TransformStamped { header, child_frame_id: patch.frame_id.clone(), transform })
    };
    let transforms: Vec<TransformStamped> = patches.iter().filter_map(place).collect();
    match transforms.is_empty() {
        true => Ok(None),
        false => cdr(&TfMessage { transforms }).map(Some),
    }
}

/// The text of a patch's scene.
///
/// # Errors
/// As [`Messages::wrench`].
pub fn scene(patch: &Patch) -> Result<Vec<u8>> {
    cdr(&Text { data: patch.text.clone() })
}

/// The states of patches.
///
/// # Errors
/// As [`Messages::wrench`].
pub fn diagnostics(array: &DiagnosticArray) -> Result<Vec<u8>> {
    cdr(array)
}

/// The definitions of a message type: its own and those that it uses.
fn definitions<M: Message>() -> Vec<Definition> {
    [(M::NAME, M::TEXT)].into_iter().chain(M::USES.iter().copied()).collect()
}

/// Writes the definitions of all messages into a folder, as `package/msg/Type.msg`; says which.
///
/// # Errors
/// A folder that cannot be written.
pub fn write_definitions(folder: &Path) -> Result<String> {
    let all = [
        definitions::<WrenchStamped>(),
        definitions::<Contacts>(),
        definitions::<MarkerArray>(),
        definitions::<PointCloud2>(),
        definitions::<Image>(),
        definitions::<Text>(),
        definitions::<TfMessage>(),
        definitions::<DiagnosticArray>(),
        definitions::<Empty>(),
    ];
    let mut all: Vec<(String, &str)> = all
        .concat()
        .into_iter()
        .map(|(name, text)| (name.replace("/msg/", "/").replacen('/', "/msg/", 1), text))
        .collect();
    all.sort();
    all.dedup();
    let mut said = String::new();
    for (name, text) in all {
        let path = folder.join(format!("{name}.msg"));
        let parent = path.parent().unwrap_or(folder);
        std::fs::create_dir_all(parent).with_context(|| parent.display().to_string())?;
        std::fs::write(&path, text).with_context(|| path.display().to_string())?;
        writeln!(said, "{}", path.display())?;
    }
    Ok(said)
}
