//! Tests of the viewer through its accessibility tree and by mouse, as a user or a screen reader would drive it.

mod calibrate;
mod careful;
mod causes;
mod clear;
mod companions;
mod drawn;
mod exports;
mod first_sensor;
mod found;
mod ground;
mod live;
mod mouse;
mod overwrite;
mod palette;
mod plots;
mod rig;
mod small;
mod steady;
mod tune;
mod typed;
mod welcome;
mod window;
mod wrong;
