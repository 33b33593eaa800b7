//! Energy that a scheme makes by itself, and taking back the step that makes too much.

use crate::collision::{Contacts, Grip};
use crate::state::{Archive, State};

/// What a scheme has made and not lost again, and what a step that makes too much is taken back to.
#[derive(Debug, Default)]
pub(super) struct Surplus {
    booked: Booked,
    /// `booked` as it was when a step was first tried.
    remembered: Booked,
    /// The grips before the step.
    grips: Vec<Grip>,
}

/// Energy made, against what the cloth ever had without it.
#[derive(Clone, Copy, Debug, Default)]
struct Booked {
    /// Energy made (J).
    made: f64,
    /// Most kinetic and elastic energy less what was made (J).
    most: f64,
}

/// Share of the cloth's own energy that may be made. Without damping `hanging-cloth` makes 0.07 % at
/// 1/250 s, `drape` and `thin-shell` 0.9 % at 1 ms; where they ring, at 1/250 s, each several times what
/// they have.
const SHARE: f64 = 0.1;

impl Surplus {
    /// Keeps the contacts of a step that begins.
    pub(super) fn begin(&mut self, contacts: &Contacts) {
        self.grips.clone_from(&contacts.grips);
    }

    /// Goes back to where the step began.
    pub(super) fn take_back(&self, before: &State, contacts: &mut Contacts, state: &mut State) {
        state.copy_from(before);
        contacts.grips.clone_from(&self.grips);
    }

    pub(super) fn remember(&mut self) {
        self.remembered = self.booked;
    }

    pub(super) fn recall(&mut self) {
        self.booked = self.remembered;
    }

    pub(super) fn follow(&mut self, other: &Self) {
        self.booked = other.booked;
    }

    /// Carries over what is booked.
    pub(super) fn carry(&mut self, archive: &mut Archive) {
        archive.real(&mut self.booked.made);
        archive.real(&mut self.booked.most);
    }

    /// Books the energy that a step made (J), negative when it lost some, up to a state that has
    /// `energy`, kinetic and elastic (J). False, and nothing booked, when it made more than may be;
    /// `floor` (J) counts as nothing.
    pub(super) fn book(&mut self, made: f64, energy: f64, floor: f64) -> bool {
        let sum = self.booked.made + made;
        let most = self.booked.most.max(energy - sum.max(0.0));
        // Never with what is no number.
        let fits = made <= 0.0 || sum <= SHARE * most + floor;
        if fits {
            self.booked = Booked {
                made: sum.max(0.0),
                most,
            };
        }
        fits
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What comes and goes is no surplus, what adds up is; a step that loses energy always fits, and what
    /// it lost can be made again.
    #[test]
    fn a_tenth_is_as_much_as_may_be_made() {
        let mut surplus = Surplus::default();
        for _ in 0..1000 {
            assert!(surplus.book(0.09, 1.09, 0.0) && surplus.book(-0.09, 1.0, 0.0));
        }
        let steps = (0..1000).find(|n| !surplus.book(0.01, 1.0 + 0.01 * f64::from(*n), 0.0));
        assert_eq!(steps, Some(10));
        assert!(!surplus.book(f64::NAN, 1.0, 0.0) && !surplus.book(1.0, 2.0, 0.0));
        assert!(surplus.book(-0.05, 1.05, 0.0) && surplus.book(0.045, 1.1, 0.0));
        assert!(!surplus.book(0.01, 1.1, 0.0) && surplus.book(0.01, 1.1, 0.02));
    }
}
