//! The `smithwalk` command.

fn main() {}
