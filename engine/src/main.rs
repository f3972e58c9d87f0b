//! The command `kerfem`.

mod cli;

use std::process::ExitCode;

use clap::Parser;
use cli::arguments;

fn main() -> ExitCode {
    let command = match cli::Command::try_parse() {
        Ok(command) => command,
        Err(error) => {
            if !error.use_stderr() {
                // help and version are answers, not mistakes
                let _ = error.print();
                return ExitCode::SUCCESS;
            }
            eprintln!("kerfem: {}", arguments::mistake(&error));
            return ExitCode::from(2);
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
