//! Files that appear whole or not at all.

use std::io::{self, BufWriter, Write};
use std::path::Path;

use super::IoError;

/// Writes a file through `content` so that `path` either keeps what it had or holds all of the new content: the bytes go to
/// a temporary file in the same directory, which then takes the place of `path`. The directory must exist.
///
/// Whole means whole for whoever reads `path` at any time, also if the program is killed; a loss of power is not covered
/// (nothing is forced to the disk).
///
/// # Errors
/// [`IoError::Write`] with what the system, or `content`, says; `path` is then as it was.
pub fn write_atomically(
    path: impl AsRef<Path>,
    content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), IoError> {
    let path = path.as_ref();
    let write = || -> io::Result<()> {
        if path.exists() && !path.is_file() {
            return Err(io::Error::other(
                "it is there and no regular file, which alone can be replaced",
            ));
        }
        let directory = match path.parent() {
            Some(d) if !d.as_os_str().is_empty() => d,
            _ => Path::new("."),
        };
        let mut builder = tempfile::Builder::new();
        builder.prefix(".").suffix(".part");
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            builder.permissions(std::fs::Permissions::from_mode(0o666)); // less the umask, like any new file
        }
        let mut out = BufWriter::new(builder.tempfile_in(directory)?);
        content(&mut out)?;
        let file = out.into_inner().map_err(|e| e.into_error())?;
        file.persist(path).map_err(|e| e.error)?;
        Ok(())
    };
    write().map_err(|source| IoError::Write {
        path: path.into(),
        source,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_what_was_there() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.txt");
        write_atomically(&path, |w| w.write_all(b"first")).unwrap();
        let failed = write_atomically(&path, |w| {
            w.write_all(b"half of the sec")?;
            Err(io::Error::other("no more"))
        });
        assert!(
            failed
                .unwrap_err()
                .to_string()
                .contains("a.txt: cannot be written: no more")
        );
        assert_eq!(std::fs::read(&path).unwrap(), b"first");
        assert_eq!(
            std::fs::read_dir(dir.path()).unwrap().count(),
            1,
            "no temporary file is left"
        );
        write_atomically(&path, |w| w.write_all(b"second")).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"second");
    }

    #[test]
    fn a_missing_directory_is_an_error() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("none").join("a.txt");
        assert!(write_atomically(&path, |_| Ok(())).is_err());
    }

    #[cfg(unix)]
    #[test]
    fn the_file_has_ordinary_permissions() {
        use std::os::unix::fs::PermissionsExt;
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.txt");
        write_atomically(&path, |w| w.write_all(b"x")).unwrap();
        let plain = dir.path().join("b.txt");
        std::fs::write(&plain, b"x").unwrap();
        let mode = |p: &Path| std::fs::metadata(p).unwrap().permissions().mode();
        assert_eq!(mode(&path), mode(&plain));
    }
}
