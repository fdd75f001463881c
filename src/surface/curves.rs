//! Curves cut into segments.
