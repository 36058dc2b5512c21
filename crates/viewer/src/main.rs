//! The `manylight` program.

fn main() -> std::process::ExitCode {
    viewer::run()
}
