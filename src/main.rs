//! The command `tetmill`.

use csg as _;
use tetmill as _;

fn main() {}
