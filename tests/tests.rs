//! tetmill as its users run it: geometries, ranks, the command line, MPI.

mod cli;
mod common;
mod geometries;
mod inputs;
mod kept;
mod mpirun;
mod mpirun_comm;
mod quality;
mod ranks;
mod readers;
mod samples;
mod swept;
mod tutorials;
mod writers;
