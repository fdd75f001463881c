//! tetmill as its users run it: geometries, ranks, the command line, MPI.

mod cli;
mod clients;
mod common;
mod decompose;
mod geometries;
mod inputs;
mod kept;
mod mpirun;
mod mpirun_comm;
mod outputs;
mod parts;
mod quality;
mod random_scenes;
mod ranks;
mod readers;
mod repartition;
mod samples;
mod scenes;
mod skins;
mod surfaces;
mod swept;
mod tutorials;
mod vtu_clients;
mod writers;
