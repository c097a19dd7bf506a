//! By mouse.
