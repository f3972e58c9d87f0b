//! The command `kerfem`.

mod cli;

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    let command = match cli::Command::try_parse() {
        Ok(command) => command,
        Err(error) => {
            // help and version are answers, not mistakes
            let code = if error.use_stderr() { 2 } else { 0 };
            let _ = error.print();
            return ExitCode::from(code);
        }
    };
    match command.execute() {
        Ok(code) => ExitCode::from(code),
        Err(error) => {
            eprintln!("kerfem: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}
