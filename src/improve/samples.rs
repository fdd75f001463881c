//! Meshes to be improved in tests.
