//! The library as programs use it: meshing, files and their readers, MPI.

mod brep;
mod clients;
#[allow(dead_code)]
mod folders;
mod kept;
mod layers;
mod library;
mod mpirun_comm;
mod readers;
mod samples;
mod small_faces;
mod surfaces;
mod touching;
mod writers;
