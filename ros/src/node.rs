//! The node: a worker per core answers the streams of its patches, and publishes their results.

use std::io::Error;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime};

use anyhow::{anyhow, Result};
use dermis_flow::jobs::Interrupt;
use dermis_flow::say;
use dermis_golden::data::recording::message::DiagnosticArray;
use dermis_golden::data::text::Stated;
use dermis_golden::engine::CheckPace;
use dermis_host::recording::header;
use dermis_host::stream::{
    run_together, Clock, Estimators, Faster, Member, Outcome, Policy, Stop, StreamAnswer, StreamOptions, ZeroRequest,
};

use crate::carrier::{Carrier, DdsNode, Publisher, Subscription, ZenohNode};
use crate::diagnostics::{Changes, Measured, PatchState, PERIOD};
use crate::engines::{Engines, PatchEngine};
use crate::messages::{self, Messages};
use crate::patches::{CarrierName, NodeFields, Patch, PatchFile};
use crate::source;
use crate::topics::{self, PatchTopics};

/// Joins the network of ROS 2 as the node of these fields.
fn join(fields: &NodeFields) -> Result<Box<dyn Carrier>> {
    Ok(match fields.carrier {
        CarrierName::Zenoh => Box::new(ZenohNode::open(fields)?),
        CarrierName::Dds => Box::new(DdsNode::open(fields)?),
    })
}

/// What a patch publishes.
struct Outlet {
    messages: Messages,
    state: Arc<PatchState>,
    wrench: Box<dyn Publisher>,
    contacts: Box<dyn Publisher>,
    arrows: Box<dyn Publisher>,
    forces: Option<Box<dyn Publisher>>,
    stress: Option<Box<dyn Publisher>>,
    /// Kept as long as it is published.
    _scene: Box<dyn Publisher>,
    _tare: Box<dyn Subscription>,
    zero: ZeroRequest,
    /// Least time between results that are published.
    period: Duration,
}

impl Outlet {
    fn open(carrier: &dyn Carrier, file: &PatchFile, patch: &Patch, state: Arc<PatchState>) -> Result<Outlet> {
        let topics = PatchTopics::new(&file.node.namespace, patch);
        let optional = |topic: &Option<topics::Topic>| topic.as_ref().map(|own| carrier.publisher(own)).transpose();
        let zero = ZeroRequest::default();
        let zero_request = zero.clone();
        let scene = carrier.publisher(&topics.scene)?;
        scene.put(messages::scene(patch)?)?;
        Ok(Outlet {
            messages: Messages::new(patch),
            state,
            wrench: carrier.publisher(&topics.wrench)?,
            contacts: carrier.publisher(&topics.contacts)?,
            arrows: carrier.publisher(&topics.arrows)?,
            forces: optional(&topics.forces)?,
            stress: optional(&topics.stress)?,
            _scene: scene,
            _tare: carrier.subscription(&topics.tare, Box::new(move || zero_request.now()))?,
            zero,
            period: file.node.rate_Hz.map_or(Duration::ZERO, |rate| Duration::from_secs_f64(1.0 / rate)),
        })
    }

    /// Publishes a result; what is large only while there is a subscriber.
    fn publish(&self, answer: &StreamAnswer) -> Result<()> {
        self.wrench.put(self.messages.wrench(answer)?)?;
        self.contacts.put(self.messages.contacts(answer)?)?;
        if self.arrows.is_wanted() {
            self.arrows.put(self.messages.arrows(answer)?)?;
        }
        let wanted = |publisher: &Option<Box<dyn Publisher>>| publisher.as_ref().is_some_and(|own| own.is_wanted());
        let forces = if wanted(&self.forces) { self.messages.forces(answer)? } else { None };
        let stress = if wanted(&self.stress) { self.messages.stress(answer)? } else { None };
        for (publisher, message) in [(&self.forces, forces), (&self.stress, stress)] {
            if let (Some(publisher), Some(message)) = (publisher, message) {
                publisher.put(message)?;
            }
        }
        Ok(())
    }
}

/// A patch of a worker.
struct WorkerPatch<'a> {
    patch: &'a Patch,
    engine: &'a PatchEngine,
    outlet: &'a Outlet,
}

/// Nanoseconds since 1970.
fn now_ns() -> i64 {
    let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    i64::try_from(since.as_nanos()).unwrap_or(i64::MAX)
}

/// Publishes the patches of a file until their sources have ended, or the program is interrupted; or for the time `measure`, of which
/// the text says how the patches did.
///
/// # Errors
/// A scene that its engine refuses, an address that cannot be used.
pub fn run(file: &PatchFile, measure: Option<Duration>) -> Result<String> {
    let engines = Engines::build(file)?;
    let carrier = join(&file.node)?;
    let changes = Arc::new(Changes::default());
    let late = Duration::from_secs_f64(file.node.late_ms / 1e3);
    let mut outlets = Vec::new();
    for (index, patch) in file.patches.iter().enumerate() {
        let state = PatchState::new(index, &patch.fields.name, &patch.scene.name, late, Arc::clone(&changes));
        outlets.push(Outlet::open(carrier.as_ref(), file, patch, Arc::new(state))?);
    }
    let poses = match messages::poses(&file.patches, now_ns())? {
        Some(message) => {
            let publisher = carrier.publisher(&topics::tf_static())?;
            publisher.put(message)?;
            Some(publisher)
        }
        None => None,
    };
    let reports = carrier.publisher(&topics::diagnostics())?;
    carrier.complete()?;
    let stop = Stop::default();
    let stopping = stop.clone();
    Interrupt::with(move || stopping.now())?;
    let (patches, threads) = (file.patches.len(), file.threads());
    say!("{}: {patches} patches, {threads} workers, at {}", file.node.name, carrier.address());
    let running = AtomicBool::new(true);
    let begun = Instant::now();
    if let Some(time) = measure {
        outlets.iter().for_each(|outlet| outlet.state.measure());
        let stop = stop.clone();
        std::thread::spawn(move || {
            std::thread::sleep(time);
            stop.now();
        });
    }
    let all: Vec<WorkerPatch> = std::iter::zip(&file.patches, std::iter::zip(engines.each(), &outlets))
        .map(|(patch, (engine, outlet))| WorkerPatch { patch, engine, outlet })
        .collect();
    let share = (threads.max(1) as f64 / patches as f64).min(1.0);
    std::thread::scope(|scope| {
        let reporting = scope.spawn(|| report(&outlets, &changes, reports.as_ref(), &running));
        // A board keeps its worker waiting: it has one of its own.
        let (boards, computed): (Vec<&WorkerPatch>, Vec<&WorkerPatch>) =
            all.iter().partition(|member| member.patch.fields.board.is_some());
        let divided = (0..threads).map(|worker| computed.iter().copied().skip(worker).step_by(threads).collect());
        let groups: Vec<Vec<&WorkerPatch>> = divided.chain(boards.iter().map(|member| vec![*member])).collect();
        let stop = &stop;
        let workers: Vec<_> =
            groups.into_iter().map(|group| scope.spawn(move || work(stop, file, &group, share))).collect();
        let failed = workers.into_iter().filter_map(|worker| worker.join().err()).count();
        running.store(false, Ordering::Release);
        let reported = reporting.join().map_err(|_| anyhow!("the thread of the diagnostics has ended"));
        reported.and_then(|done| done).and(if failed == 0 {
            Ok(())
        } else {
            Err(anyhow!("{failed} workers have ended"))
        })
    })?;
    let said = measure.map_or_else(String::new, |_| measured(file, &outlets, begun.elapsed()));
    drop((outlets, poses, reports));
    carrier.close().map(|()| said)
}

/// A line per patch, then one of all.
fn measured(file: &PatchFile, outlets: &[Outlet], time: Duration) -> String {
    let (mut all, mut text) = (Measured::default(), String::new());
    for (patch, outlet) in std::iter::zip(&file.patches, outlets) {
        let own = outlet.state.measured();
        all.add(own.clone());
        text += &own.line(&patch.fields.name, time.as_secs_f64());
    }
    text + &all.line("all", time.as_secs_f64())
}

/// Answers the streams of a worker until they have ended.
fn work<'a>(stop: &Stop, file: &PatchFile, all: &[&'a WorkerPatch<'a>], share: f64) {
    let options =
        StreamOptions { queue: file.node.queue, policy: Policy::Latest, live: true, layout: Stated::default() };
    let member = |member: &&'a WorkerPatch<'a>| {
        let (patch, engine) = (member.patch, member.engine.engine());
        let pace = match patch.fields.check_every {
            Some(period) => CheckPace::Every(period),
            // A core of its own, beside which there is time.
            None if share >= 1.0 => CheckPace::Beside,
            None => CheckPace::Never,
        };
        let faster = match patch.fields.board {
            Some(_) => Vec::new(),
            None => Faster::of_stream(&patch.scene, patch.engine, None),
        };
        let estimators = Estimators::new(engine, faster, pace, None, Clock::default()).with_share(share);
        let input = (source::input(patch, Arc::clone(&member.outlet.state)), patch.fields.source.clone());
        Member { estimators, input, options, zero: member.outlet.zero.clone() }
    };
    let members: Vec<Member> = all.iter().map(member).collect();
    let mut published: Vec<Option<Instant>> = vec![None; all.len()];
    let ends = run_together(stop, members, &mut |index, outcome| {
        let WorkerPatch { patch, outlet, .. } = all[index];
        let name = &patch.fields.name;
        match outcome {
            Outcome::Note(text) => say!("{name}: {text}"),
            // Only the first one: a source may send nothing else. The diagnostics count them.
            Outcome::Refusal(refusal) => {
                if outlet.state.refused(refusal.error) {
                    say!("{name}: line {}: {}", refusal.line, refusal.error);
                }
            }
            Outcome::Answer(answer) => {
                outlet.state.answer(answer);
                if published[index].is_some_and(|before| before.elapsed() < outlet.period) {
                    return Ok(());
                }
                published[index] = Some(Instant::now());
                outlet.publish(answer).map_err(|error| Error::other(format!("{error:#}")))?;
            }
        }
        Ok(())
    });
    for (member, end) in std::iter::zip(all, ends) {
        let name = &member.patch.fields.name;
        match end {
            Ok(counts) => say!("{name}: {} results; {counts}", counts.answered),
            Err(error) => {
                say!("{name}: {error:#}");
                member.outlet.state.ended(Some(format!("{error:#}")));
            }
        }
    }
}

/// Publishes the states until the workers have ended: all once per second, those that change at once.
fn report(outlets: &[Outlet], changes: &Changes, reports: &dyn Publisher, running: &AtomicBool) -> Result<()> {
    let mut due = Instant::now() + PERIOD;
    loop {
        let last = !running.load(Ordering::Acquire);
        let changed = changes.within(due.saturating_duration_since(Instant::now()).min(PERIOD / 10));
        let all = Instant::now() >= due || last;
        let status = match all {
            true => outlets.iter().map(|outlet| outlet.state.status(true)).collect::<Vec<_>>(),
            false => changed.into_iter().map(|index| outlets[index].state.status(false)).collect(),
        };
        if all {
            due += PERIOD;
        }
        if !status.is_empty() {
            reports.put(messages::diagnostics(&DiagnosticArray { header: header("", now_ns()), status })?)?;
        }
        if last {
            return Ok(());
        }
        Changes::gather();
    }
}
