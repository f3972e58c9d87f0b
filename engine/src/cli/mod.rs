//! What each call of the command does.

/// Prints a line. A reader that has gone away (`| head`) ends the program instead of making it panic.
macro_rules! say {
    ($($line:tt)*) => {
        if std::io::Write::write_fmt(&mut std::io::stdout(), format_args!("{}\n", format_args!($($line)*))).is_err() {
            std::process::exit(0);
        }
    };
}

mod check;
mod cut;
mod quality;
mod run;

use std::path::PathBuf;

use clap::{Parser, Subcommand, ValueEnum};
use kerfem_engine::EngineError;

/// Deformable solids that can be cut.
#[derive(Parser)]
#[command(name = "kerfem", version, disable_help_subcommand = true)]
pub(crate) struct Command {
    #[command(subcommand)]
    action: Action,
}

#[derive(Subcommand)]
enum Action {
    /// Steps a scene, cuts it, writes VTK files and a report
    Run(RunArguments),
    /// Reads and checks a scene and its mesh; runs nothing
    Check {
        /// The scene
        scene: PathBuf,
    },
    /// Counts, volume, quality of the cells and their histograms
    Quality {
        /// A tetrahedral mesh (.vtu, .msh)
        mesh: PathBuf,
        /// Print JSON
        #[arg(long)]
        json: bool,
    },
    /// Cuts a mesh; geometry only
    Cut(CutArguments),
}

#[derive(clap::Args)]
struct RunArguments {
    /// The scene
    scene: PathBuf,
    /// Folder of the results [default: out/NAME]
    #[arg(short, long)]
    output: Option<PathBuf>,
    /// Threads [default: one a core]
    #[arg(long)]
    threads: Option<usize>,
    /// Check every invariant after each cut; exit 1 if one breaks
    #[arg(long)]
    verify: bool,
    /// Write the matrices at the end, in Matrix Market files
    #[arg(long)]
    export_system: bool,
    /// Stop at this time (s)
    #[arg(long, value_name = "S")]
    until: Option<f64>,
    /// No progress bar
    #[arg(long)]
    quiet: bool,
}

#[derive(clap::Args)]
struct CutArguments {
    /// A tetrahedral mesh (.vtu, .msh)
    mesh: PathBuf,
    /// A triangulated surface (.obj, .vtu)
    #[arg(long)]
    sweep: PathBuf,
    /// How the mesh is made to follow the sweep
    #[arg(long, default_value = "hybrid")]
    method: Method,
    /// Snapping distance as a fraction of the local mean edge
    #[arg(long, default_value_t = 0.2)]
    snap: f64,
    /// Where to write the cut mesh (.vtu)
    #[arg(short, long)]
    output: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum Method {
    Delete,
    Subdivide,
    Snap,
    Hybrid,
}

impl Command {
    /// Does what was asked for; the exit code.
    pub(crate) fn execute(self) -> Result<u8, EngineError> {
        match self.action {
            Action::Run(arguments) => run::run(&arguments),
            Action::Check { scene } => check::check(&scene),
            Action::Quality { mesh, json } => quality::quality(&mesh, json),
            Action::Cut(arguments) => cut::cut(&arguments),
        }
    }
}

/// A mistake in the arguments.
fn bad(place: impl Into<String>, message: impl Into<String>) -> EngineError {
    EngineError::Scene {
        place: place.into(),
        message: message.into(),
    }
}

/// A tetrahedral mesh from a file.
fn read_tets(path: &std::path::Path) -> Result<kerfem_mesh::TetMesh, EngineError> {
    let data = kerfem_mesh::io::read_mesh(path).map_err(EngineError::Read)?;
    if data.tets.is_empty() {
        return Err(bad(
            path.display().to_string(),
            "the file has no tetrahedra; a tetrahedral mesh is needed",
        ));
    }
    data.into_tet_mesh()
        .map_err(|e| bad(path.display().to_string(), e.to_string()))
}
