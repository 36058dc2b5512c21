//! The program as the tests run it.
fn main() -> std::process::ExitCode {
    viewer::run()
}
