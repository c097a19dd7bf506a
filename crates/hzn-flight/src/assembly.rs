//! The packets of a picture, put together on the ground. The science packet comes last.

use hzn_core::report::MAX_LISTED;

use crate::answer::{Edge, PictureAnswer, Position};
use crate::bytes::Reader;
use crate::integrity::Integrity;
use crate::messages::{AttitudeState, Exposure, NavigationState};
use crate::packet::Apid;

/// The packets that have come of a picture.
#[derive(Debug, Clone, Default)]
pub struct Assembly {
    picture: u32,
    position: Option<Position>,
    integrity: Option<Integrity>,
    navigation: Option<NavigationState>,
    attitude: Option<AttitudeState>,
    edges: heapless::Vec<Edge, MAX_LISTED>,
}

/// A picture whose science packet has come.
#[derive(Debug, Clone)]
pub struct Assembled {
    /// Picture and time.
    pub exposure: Exposure,
    /// The answer, with what has come of its position, of its integrity and of its candidates.
    pub answer: PictureAnswer,
    /// The values from navigation that the picture was processed with.
    pub navigation: Option<NavigationState>,
    /// The attitude and the Sun that the picture was processed with.
    pub attitude: Option<AttitudeState>,
    /// Number of candidates whose packets are missing.
    pub missing_candidates: u8,
}

impl Assembly {
    /// Takes the user data of a packet. Returns the picture if it is a science packet; `None` if the user data are no
    /// packet of a picture.
    pub fn take(&mut self, apid: Apid, user: &[u8]) -> Option<Option<Assembled>> {
        let mut from = Reader::new(user);
        let from = &mut from;
        let assembled = match apid {
            Apid::Candidate => {
                self.begin(from.u32()?);
                // A list that is full belongs to a damaged stream.
                let _ = self.edges.push(Edge::read(from)?);
                None
            }
            Apid::Position => {
                self.begin(from.u32()?);
                self.position = Some(Position::read(from)?);
                None
            }
            Apid::Integrity => {
                self.begin(from.u32()?);
                self.integrity = Some(Integrity::read(from)?);
                None
            }
            Apid::Navigation => {
                let navigation = NavigationState::read(from)?;
                self.begin(navigation.picture);
                self.navigation = Some(navigation);
                None
            }
            Apid::Attitude => {
                let attitude = AttitudeState::read(from)?;
                self.begin(attitude.picture);
                self.attitude = Some(attitude);
                None
            }
            Apid::Science => Some(self.end(Exposure::read(from)?, PictureAnswer::read_science(from)?)),
            _ => return None,
        };
        from.rest().is_empty().then_some(assembled)
    }

    /// Removes the packets of another picture.
    fn begin(&mut self, picture: u32) {
        if picture != self.picture {
            // The science packet of the picture before was lost, so that these packets have no answer.
            *self = Self { picture, ..Self::default() };
        }
    }

    fn end(&mut self, exposure: Exposure, mut answer: PictureAnswer) -> Assembled {
        self.begin(exposure.picture);
        let come = core::mem::take(self);
        // Without a direction there is nothing to trust, whatever a damaged stream says.
        (answer.position, answer.integrity) = (come.position, answer.direction.and(come.integrity));
        for (place, edge) in answer.edges.iter_mut().zip(&come.edges) {
            *place = Some(*edge);
        }
        // The answer says how many were sent, so that a lost packet is noticed.
        let missing_candidates = answer.outcome.listed.saturating_sub(come.edges.len() as u8);
        Assembled { exposure, answer, navigation: come.navigation, attitude: come.attitude, missing_candidates }
    }
}
