//! The command line of Shellock.

fn main() {}
