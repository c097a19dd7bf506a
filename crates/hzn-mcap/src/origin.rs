//! Where a record comes from: the only camera, a head of a rig, or the joint answer of its heads.

use std::io::{self, BufWriter};

use hzn_core::camera;

use crate::container::Container;
use crate::messages::{CAMERA, VEHICLE};
use crate::row::Row;
use crate::topics::Topic;

/// The origin of a record, with the frame of its messages and its channels.
pub(crate) struct Origin<'a> {
    /// Number and name of the head.
    head: Option<(usize, &'a str)>,
    /// Name of the frame of its directions.
    pub(crate) frame_id: &'a str,
    /// The calibration of its camera.
    pub(crate) camera: Option<&'a camera::Config>,
}

impl<'a> Origin<'a> {
    /// Finds the origin of a row. `camera` is the only camera of a recording without heads.
    pub(crate) fn find(row: &Row, heads: &'a [(String, camera::Config)], camera: Option<&'a camera::Config>) -> Self {
        let Some(name) = &row.head else { return Self { head: None, frame_id: CAMERA, camera } };
        match heads.iter().enumerate().find(|(_, head)| head.0 == *name) {
            Some((number, (name, camera))) => Self { head: Some((number, name)), frame_id: name, camera: Some(camera) },
            None => Self { head: None, frame_id: VEHICLE, camera: None },
        }
    }

    /// Returns the number of the camera.
    pub(crate) fn number(&self) -> usize {
        self.head.map_or(0, |(number, _)| number)
    }

    /// Declares the channel of a topic, if it is not declared yet, and returns its id.
    pub(crate) fn declare<W: io::Write>(
        &self,
        topic: Topic,
        container: &mut Container<BufWriter<W>>,
    ) -> io::Result<u16> {
        let (id, channel) = match self.head {
            Some((number, name)) => topic.of_head(number, name),
            None => (topic.id(), topic.name().to_owned()),
        };
        if !container.has_channel(id) {
            let (name, encoding, data, message_encoding) = topic.schema();
            container.schema(topic.id(), &name, &encoding, &data)?;
            container.channel(id, topic.id(), &channel, message_encoding)?;
        }
        Ok(id)
    }
}
