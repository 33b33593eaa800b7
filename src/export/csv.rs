//! Tables of states.

use std::io::{self, Write};

use crate::frame::Checkpoint;

/// Writes one row a particle: `cloth,particle,x,y,z,vx,vy,vz` (m and m/s).
///
/// Numbers have as few digits as give back the same `f64`. A name with a comma, a quote or a line
/// break is put in quotes, as RFC 4180 says.
///
/// # Errors
///
/// When `out` can't be written.
pub fn write_csv(checkpoint: &Checkpoint, out: &mut impl Write) -> io::Result<()> {
    writeln!(out, "cloth,particle,x,y,z,vx,vy,vz")?;
    for cloth in &checkpoint.cloths {
        let name = quoted(&cloth.name);
        for (particle, [x, y, z, vx, vy, vz]) in cloth.particles.iter().enumerate() {
            writeln!(
                out,
                "{name},{particle},{x:?},{y:?},{z:?},{vx:?},{vy:?},{vz:?}"
            )?;
        }
    }
    Ok(())
}

fn quoted(name: &str) -> String {
    if name.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", name.replace('"', "\"\""))
    } else {
        name.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::ClothCheckpoint;

    fn checkpoint(step: u64) -> Checkpoint {
        let third = step as f64 / 3.0;
        let awkward = [
            third,
            -0.0,
            f64::MIN_POSITIVE / 8.0,
            1e300,
            0.1 + 0.2,
            -third,
        ];
        let cloth = |name: &str, n: usize| ClothCheckpoint {
            name: name.to_owned(),
            particles: vec![awkward; n],
        };
        Checkpoint {
            step,
            time: step as f64 * 0.1,
            cloths: vec![cloth("zeta, front/1", 3), cloth("alpha", 2)],
            luggage: Vec::new(),
        }
    }

    #[test]
    fn csv_numbers_parse_to_the_same_bits() {
        let checkpoint = checkpoint(7);
        let mut text = Vec::new();
        write_csv(&checkpoint, &mut text).unwrap();
        let text = String::from_utf8(text).unwrap();
        let mut lines = text.lines();
        assert_eq!(lines.next(), Some("cloth,particle,x,y,z,vx,vy,vz"));
        assert!(text.contains("\"zeta, front/1\",2,"), "{text}");
        let row = text
            .lines()
            .find(|line| line.starts_with("alpha,1,"))
            .unwrap();
        let numbers: Vec<u64> = row
            .split(',')
            .skip(2)
            .map(|number| number.parse::<f64>().unwrap().to_bits())
            .collect();
        let expected = checkpoint.cloths[1].particles[1].map(f64::to_bits);
        assert_eq!(numbers, expected);
    }
}
