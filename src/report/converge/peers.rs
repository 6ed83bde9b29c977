//! Other renderers' measurements, from CSV files.

use std::path::{Path, PathBuf};

use super::Run;

/// Why a file of measurements can't be used: all that is wrong with it.
#[derive(Debug, thiserror::Error)]
#[error("{}", self.lines())]
pub struct PeerError {
    path: PathBuf,
    /// Line, if it is about one, and what is wrong.
    problems: Vec<(Option<u64>, String)>,
}

impl PeerError {
    fn lines(&self) -> String {
        let line = |(line, what): &(Option<u64>, String)| match line {
            Some(line) => format!("{}:{line}: {what}", self.path.display()),
            None => format!("{}: {what}", self.path.display()),
        };
        let lines: Vec<_> = self.problems.iter().map(line).collect();
        lines.join("\n")
    }
}

/// Reads rows of `name,spp,wall_s,cpu_s,rel_mse` under a header, which may have
/// further columns; see [`Run`] for what they mean. Their errors should be
/// against the peer's own converged image.
///
/// # Errors
/// When the file can't be read or any row is no measurement.
pub fn read_peers(path: &Path) -> Result<Vec<Run>, PeerError> {
    let mut runs = Vec::new();
    let mut problems = Vec::new();
    let trouble = |error: csv::Error| {
        let line = error.position().map(csv::Position::line);
        let what = match error.kind() {
            csv::ErrorKind::Deserialize { err, .. } => err.to_string(),
            csv::ErrorKind::UnequalLengths {
                expected_len, len, ..
            } => format!("expected {expected_len} values, found {len}"),
            csv::ErrorKind::Io(io) => io.to_string(),
            _ => error.to_string(),
        };
        (line, what)
    };
    match csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .from_path(path)
    {
        Ok(mut reader) => {
            for (index, row) in reader.deserialize().enumerate() {
                let run: Run = match row {
                    Ok(run) => run,
                    Err(error) => {
                        problems.push(trouble(error));
                        continue;
                    }
                };
                // The header is line 1.
                let line = Some(index as u64 + 2);
                problems.extend(complaints(&run).map(|what| (line, what)));
                runs.push(run);
            }
        }
        Err(error) => problems.push(trouble(error)),
    }
    if runs.is_empty() && problems.is_empty() {
        let what = "no measurements; expected the columns name, spp, wall_s, cpu_s, rel_mse";
        problems.push((None, what.to_owned()));
    }
    if problems.is_empty() {
        Ok(runs)
    } else {
        Err(PeerError {
            path: path.to_owned(),
            problems,
        })
    }
}

fn complaints(run: &Run) -> impl Iterator<Item = String> + use<> {
    let time = |name, value: f64| {
        let good = value.is_finite() && value > 0.0;
        (!good).then(|| format!("{name} is {value}; expected seconds, greater than zero"))
    };
    [
        (run.spp == 0).then(|| "spp is 0; expected at least 1".to_owned()),
        time("wall_s", run.wall_s),
        time("cpu_s", run.cpu_s),
        (!run.rel_mse.is_finite())
            .then(|| format!("rel_mse is {}; expected a finite number", run.rel_mse)),
    ]
    .into_iter()
    .flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(name: &str, text: &str) -> Result<Vec<Run>, PeerError> {
        let file = format!("smithwalk-peers-{}-{name}.csv", std::process::id());
        let path = std::env::temp_dir().join(file);
        std::fs::write(&path, text).unwrap();
        let result = read_peers(&path);
        std::fs::remove_file(&path).unwrap();
        result
    }

    #[test]
    fn rows_with_more_columns_are_read() {
        let text = "name,spp,wall_s,cpu_s,rel_mse,machine\nCycles, 64, 2.0,3.63,2.3e-4,x\n";
        let runs = read("good", text).unwrap();
        assert_eq!(runs.len(), 1);
        let run = &runs[0];
        assert_eq!((run.name.as_str(), run.spp, run.seed), ("Cycles", 64, None));
        assert_eq!((run.wall_s, run.cpu_s, run.rel_mse), (2.0, 3.63, 2.3e-4));
    }

    #[test]
    fn all_that_is_wrong_is_told_with_its_line() {
        let text = "name,spp,wall_s,cpu_s,rel_mse\n\
                    a,0,1,2,1e-3\n\
                    a,x,1,2,1e-3\n\
                    a,1,-1,2,NaN\n\
                    a,1,2\n";
        let message = read("bad", text).unwrap_err().to_string();
        for part in [
            ":2: spp is 0",
            ":3: ",
            ":4: wall_s is -1",
            ":4: rel_mse is NaN",
            ":5: expected 5 values, found 3",
        ] {
            assert!(message.contains(part), "{part} is not in\n{message}");
        }
        let missing = read("missing", "name,spp,cpu_s,rel_mse\na,1,2,3\n").unwrap_err();
        assert!(missing.to_string().contains("wall_s"), "{missing}");
        assert!(read("empty", "").is_err());
        assert!(read_peers(Path::new("/nowhere/peers.csv")).is_err());
    }
}
