//! Plays frames into a [`Device`] and records every transfer with its cycle.
//!
//! Full speed: one code a cycle, output always ready, a frame starts when the one before is out.
//! Stalls: seeded random gaps on both streams, the next frame offered as soon as the device takes
//! it. Input codes follow the AXI rule (an offered beat stays until it is taken), and the same rule
//! is checked on the output. Before a run with stalls half a frame is left in the device, and the reset
//! must clear it.
//!
//! **Counting.** Cycles are numbered from 0 at the first cycle of reset. A beat's cycle is the one
//! in which valid and ready are both set. latency = cycle of the last output beat − cycle of the last
//! input beat; total = cycle of the last output beat − cycle of the first input beat + 1.

use dermis_hdl::device::{Device, Inputs, Outputs};

/// Cycles of reset before the first frame.
const RESET_CYCLES: u64 = 4;
/// Cycles after the last expected beat in which nothing more may come.
const TAIL_CYCLES: u64 = 64;
/// One of so many cycles starts a long pause of the receiver, which fills every buffer behind it.
const LONG_PAUSE_EVERY: u32 = 64;
/// Length of a long pause.
const LONG_PAUSE_CYCLES: u32 = 40;

/// How the two streams are clocked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stimulus {
    /// One code a cycle, output always ready: cycle counts are exact.
    FullSpeed,
    /// Random gaps on both streams.
    Stalls {
        /// Of the random numbers.
        seed: u64,
    },
}

impl std::fmt::Display for Stimulus {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Stimulus::FullSpeed => write!(f, "full speed"),
            Stimulus::Stalls { seed } => write!(f, "stalls (seed {seed})"),
        }
    }
}

/// One frame to play: its codes and how many beats it must give.
#[derive(Clone, Copy, Debug)]
pub struct Play<'a> {
    /// One code per taxel, row-major.
    pub codes: &'a [i32],
    /// Output beats of the frame, status included.
    pub beats: usize,
}

/// An output beat.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Beat {
    /// When it was transferred.
    pub cycle: u64,
    /// `[fx, fy, fz]`.
    pub data: [i32; 3],
    /// `m_axis_tlast`.
    pub last: bool,
}

/// A word that a tap showed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TapWord {
    /// When it passed.
    pub cycle: u64,
    /// Its fields.
    pub fields: Vec<i64>,
}

/// A broken promise of the output stream.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Breach {
    /// When it was seen.
    pub cycle: u64,
    /// Index of the output beat concerned, counted over all frames.
    pub beat: usize,
    /// The rule, as a sentence.
    pub rule: String,
}

/// Cycles of one frame's first and last beats.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Times {
    /// First accepted code.
    pub first_in: Option<u64>,
    /// Last accepted code.
    pub last_in: Option<u64>,
    /// Last expected output beat.
    pub last_out: Option<u64>,
}

impl Times {
    /// Cycles from the last accepted input beat to the last output beat.
    pub fn latency(&self) -> Option<u64> {
        self.last_out?.checked_sub(self.last_in?)
    }

    /// Cycles from the first accepted input beat to the last output beat, both counted.
    pub fn total(&self) -> Option<u64> {
        Some(self.last_out?.checked_sub(self.first_in?)? + 1)
    }
}

/// All that a run showed.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Recording {
    /// Output beats of all frames in order.
    pub beats: Vec<Beat>,
    /// Per tap, its words in order.
    pub taps: Vec<Vec<TapWord>>,
    /// Per frame.
    pub times: Vec<Times>,
    /// Broken rules of the output stream.
    pub breaches: Vec<Breach>,
    /// Set when the run was given up.
    pub timeout: Option<Breach>,
}

/// Plays `frames` and records what comes back; gives up after `watchdog` cycles without a transfer.
pub fn record(
    device: &mut dyn Device,
    taps: usize,
    frames: &[Play],
    stimulus: Stimulus,
    watchdog: u64,
) -> Recording {
    if let (Stimulus::Stalls { .. }, Some(first)) = (stimulus, frames.first()) {
        interrupt(device, first);
    }
    let mut receiver = Receiver::new(taps, frames);
    let mut sender = Sender {
        frames,
        frame: 0,
        taxel: 0,
        offering: false,
    };
    let mut gaps = Gaps::new(stimulus);
    let wanted: usize = frames.iter().map(|f| f.beats).sum();
    let mut idle = 0;
    let mut tail = TAIL_CYCLES;
    for cycle in 0.. {
        let mut inputs = Inputs {
            rst: cycle < RESET_CYCLES,
            ..Inputs::default()
        };
        if !inputs.rst {
            let may_start = stimulus != Stimulus::FullSpeed || receiver.frame >= sender.frame;
            sender.offer(&mut inputs, may_start && gaps.send());
            inputs.m_ready = gaps.receive();
        }
        let outputs = device.cycle(&inputs);
        if inputs.rst {
            continue;
        }
        let taken = inputs.s_valid && outputs.s_ready;
        if taken {
            sender.taken(cycle, &mut receiver.recording.times);
        }
        let given = receiver.observe(cycle, &inputs, outputs);
        idle = if taken || given { 0 } else { idle + 1 };
        if receiver.recording.beats.len() >= wanted && sender.frame == frames.len() {
            tail -= 1;
            if tail == 0 {
                break;
            }
        } else if idle >= watchdog {
            receiver.give_up(cycle, watchdog, &sender);
            break;
        }
    }
    receiver.recording
}

/// Leaves half a frame in the device: the reset that follows must clear every trace of it.
fn interrupt(device: &mut dyn Device, play: &Play) {
    for _ in 0..RESET_CYCLES {
        device.cycle(&Inputs {
            rst: true,
            ..Inputs::default()
        });
    }
    for &s_data in &play.codes[..play.codes.len() / 2] {
        device.cycle(&Inputs {
            s_valid: true,
            s_data,
            m_ready: true,
            ..Inputs::default()
        });
    }
}

/// Offers the codes.
struct Sender<'a> {
    frames: &'a [Play<'a>],
    frame: usize,
    taxel: usize,
    offering: bool,
}

impl Sender<'_> {
    fn offer(&mut self, inputs: &mut Inputs, start: bool) {
        let Some(play) = self.frames.get(self.frame) else {
            return;
        };
        self.offering |= start;
        if self.offering {
            inputs.s_valid = true;
            inputs.s_data = play.codes[self.taxel];
            inputs.s_last = self.taxel + 1 == play.codes.len();
        }
    }

    fn taken(&mut self, cycle: u64, times: &mut [Times]) {
        let times = &mut times[self.frame];
        times.first_in.get_or_insert(cycle);
        self.offering = false;
        self.taxel += 1;
        if self.taxel == self.frames[self.frame].codes.len() {
            times.last_in = Some(cycle);
            self.frame += 1;
            self.taxel = 0;
        }
    }
}

/// Collects beats and taps and watches the output's rules.
struct Receiver {
    recording: Recording,
    /// Beats up to and including each frame.
    ends: Vec<usize>,
    /// Frames whose beats are all out.
    frame: usize,
    /// A beat that was offered and not taken in the cycle before.
    held: Option<([i32; 3], bool)>,
}

impl Receiver {
    fn new(taps: usize, frames: &[Play]) -> Self {
        let ends = frames.iter().scan(0, |sum, f| {
            *sum += f.beats;
            Some(*sum)
        });
        let recording = Recording {
            taps: vec![Vec::new(); taps],
            times: vec![Times::default(); frames.len()],
            ..Recording::default()
        };
        Receiver {
            recording,
            ends: ends.collect(),
            frame: 0,
            held: None,
        }
    }

    fn breach(&mut self, cycle: u64, rule: String) {
        let beat = self.recording.beats.len();
        self.recording.breaches.push(Breach { cycle, beat, rule });
    }

    /// Whether a beat was transferred.
    fn observe(&mut self, cycle: u64, inputs: &Inputs, outputs: Outputs) -> bool {
        for (stream, word) in self.recording.taps.iter_mut().zip(outputs.taps) {
            if let Some(fields) = word {
                stream.push(TapWord { cycle, fields });
            }
        }
        let offered = outputs.m_valid.then_some((outputs.m_data, outputs.m_last));
        if let Some(held) = self.held {
            if offered != Some(held) {
                self.breach(cycle, "an offered beat must stay until it is taken".into());
            }
        }
        self.held = offered.filter(|_| !inputs.m_ready);
        let Some((data, last)) = offered.filter(|_| inputs.m_ready) else {
            return false;
        };
        match self.recording.times.get(self.frame).map(|t| t.last_in) {
            None => self.breach(cycle, "no beat may follow the last frame's".into()),
            Some(None) => self.breach(
                cycle,
                "no beat may come before the frame's last input".into(),
            ),
            Some(Some(_)) => {
                let end = self.ends[self.frame];
                let final_beat = self.recording.beats.len() + 1 == end;
                if last != final_beat {
                    let rule = if last {
                        "tlast only on the last status beat"
                    } else {
                        "tlast on the last status beat"
                    };
                    self.breach(cycle, rule.into());
                }
                if final_beat {
                    self.recording.times[self.frame].last_out = Some(cycle);
                    self.frame += 1;
                }
            }
        }
        self.recording.beats.push(Beat { cycle, data, last });
        true
    }

    fn give_up(&mut self, cycle: u64, watchdog: u64, sender: &Sender) {
        let awaited = match sender.frames.get(sender.frame) {
            // The output is behind: what is missing is a beat, whatever the input does.
            Some(_) if self.frame < sender.frame => self.awaited_beat(),
            Some(play) => format!(
                "s_axis_tready for taxel {} of {}",
                sender.taxel,
                play.codes.len()
            ),
            None => self.awaited_beat(),
        };
        let rule = format!("nothing moved for {watchdog} cycles while waiting for {awaited}");
        let beat = self.recording.beats.len();
        self.recording.timeout = Some(Breach { cycle, beat, rule });
    }

    fn awaited_beat(&self) -> String {
        let before = self.frame.checked_sub(1).map_or(0, |f| self.ends[f]);
        let end = self.ends.get(self.frame).copied().unwrap_or(before);
        format!(
            "output beat {} of {}",
            self.recording.beats.len() - before,
            end - before
        )
    }
}

/// When the two sides of the bench are willing.
struct Gaps {
    random: Option<fastrand::Rng>,
    pause: u32,
}

impl Gaps {
    fn new(stimulus: Stimulus) -> Self {
        let random = match stimulus {
            Stimulus::FullSpeed => None,
            Stimulus::Stalls { seed } => Some(fastrand::Rng::with_seed(seed)),
        };
        Gaps { random, pause: 0 }
    }

    fn send(&mut self) -> bool {
        self.random.as_mut().is_none_or(|r| r.bool())
    }

    fn receive(&mut self) -> bool {
        let Some(random) = &mut self.random else {
            return true;
        };
        if self.pause > 0 {
            self.pause -= 1;
            return false;
        }
        if random.u32(..LONG_PAUSE_EVERY) == 0 {
            self.pause = LONG_PAUSE_CYCLES;
        }
        random.bool()
    }
}
