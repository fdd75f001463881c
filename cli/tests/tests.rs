//! The program as users run it: geometries, ranks, the command line, MPI.

mod cli;
mod common;
mod decompose;
mod encodings;
mod faults;
mod flat_parts;
mod flat_stl;
mod geometries;
mod habits;
mod hdf5;
mod inputs;
mod limited;
mod mpirun;
mod near;
mod near_pairs;
mod outputs;
mod parts;
mod quality;
mod random_scenes;
mod ranks;
mod repartition;
mod scenes;
mod second_order;
#[cfg(unix)]
mod signals;
mod sizes;
mod skins;
mod small_faces;
mod swept;
mod tutorials;
mod view;
mod vtu_clients;
