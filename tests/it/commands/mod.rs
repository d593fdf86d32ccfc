//! The library and the commands of the program.

mod check;
mod command_line;
mod first_picture;
mod first_side;
mod guess;
mod inside;
mod lab;
mod library;
mod plots;
