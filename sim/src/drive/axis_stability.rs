//! The rule of a stream: an offered beat stays, and stays the same, until it is taken.

use dermis_hdl::device::Outputs;

/// What a device's output may not do.
pub(crate) const STABILITY_RULE: &str = "an offered beat must stay until it is taken";

/// Data and `tlast`.
type Offer = ([i32; 3], bool);

/// A beat that was offered and not taken in the cycle before.
#[derive(Default)]
pub(crate) struct StabilityCheck(Option<Offer>);

impl StabilityCheck {
    /// One cycle of the output: the beat that was transferred, and whether [`STABILITY_RULE`] was kept.
    pub(crate) fn observe(&mut self, outputs: &Outputs, m_ready: bool) -> (Option<Offer>, bool) {
        let offered = outputs.m_valid.then_some((outputs.m_data, outputs.m_last));
        let stable = self.0.is_none() || offered == self.0;
        self.0 = offered.filter(|_| !m_ready);
        (offered.filter(|_| m_ready), stable)
    }

    /// Whether a beat waits to be taken.
    pub(crate) fn is_pending(&self) -> bool {
        self.0.is_some()
    }
}
