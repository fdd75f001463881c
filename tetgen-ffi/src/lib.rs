//! TetGen for comparison in tests.
