//! The rule of a stream: an offered beat stays, and stays the same, until it is taken.

use dermis_hdl::device::Outputs;

/// What a device's output may not do.
pub(crate) const RULE: &str = "an offered beat must stay until it is taken";

/// Data and `tlast`.
type Offer = ([i32; 3], bool);

/// A beat that was offered and not taken in the cycle before.
#[derive(Default)]
pub(crate) struct Held(Option<Offer>);

impl Held {
    /// One cycle of the output: the beat that was transferred, and whether [`RULE`] was kept.
    pub(crate) fn observe(&mut self, outputs: &Outputs, m_ready: bool) -> (Option<Offer>, bool) {
        let offered = outputs.m_valid.then_some((outputs.m_data, outputs.m_last));
        let kept = self.0.is_none() || offered == self.0;
        self.0 = offered.filter(|_| !m_ready);
        (offered.filter(|_| m_ready), kept)
    }

    /// Whether a beat waits to be taken.
    pub(crate) fn waits(&self) -> bool {
        self.0.is_some()
    }
}
