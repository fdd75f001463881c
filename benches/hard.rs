//! Hundreds of hard surfaces: filled or not, attempts, points and time.
//!
//! Each surface is filled without points for the size field, in its own process with a time limit.
//! The check: unchanged surface, correct bodies, positive tets by exact sign, exact volumes. One
//! surface in three is rotated, one rotated and moved away from the origin.
//!
//! ```sh
//! cargo bench --bench hard                          # all families
//! cargo bench --bench hard -- prisms blocks 0 500   # some families and seeds
//! cargo bench --bench hard -- one many-prisms 7     # one surface
//! ```

mod common;
mod samples;

use common::cpu_seconds;
use csg::BodyId;
use nalgebra::Rotation3;
use samples::*;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use tetmill::Vector;
use tetmill::internals::volume::{Settings, mesh};
use tetmill::internals::{Random, UniformSize};

/// Families: name, number of seeds, description.
const FAMILIES: [(&str, u64, &str); 12] = [
    ("prisms", 120, "twisted prisms, 3 to 14 sides, 1 to 4 layers"),
    ("blocks", 60, "Chazelle's blocks, 1 to 6 notches"),
    ("skins", 60, "skins of bent lattices"),
    ("staircases", 60, "staircases of cubes in random bodies, with shifted corners"),
    ("grids", 100, "the same straight, with spacings from 1 to 10^-8.5"),
    ("lenses", 60, "sheets 1 to 10^-8.5 apart"),
    ("thin-lenses", 30, "sheets 3e-9 apart"),
    ("spikes", 60, "balls of spikes, edges turned"),
    ("shells", 40, "flat balls in one another"),
    ("needles", 30, "tubes and cones of needles of aspect 10 to 10^5"),
    ("many-prisms", 24, "twisted prisms, 15 to 100 sides, 1 or 2 layers"),
    ("many-blocks", 24, "Chazelle's blocks, 7 to 40 notches"),
];

/// Time limit of a surface.
const LIMIT: Duration = Duration::from_secs(300);

/// One surface in three is moved away by this multiple of its size.
const AWAY: f64 = 30.0;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).filter(|w| w != "--bench").collect();
    if let [one, family, seed] = &words[..]
        && one == "one"
    {
        println!("{}", fill(family, seed.parse().expect("a seed")));
        return;
    }
    let numbers: Vec<u64> = words.iter().filter_map(|w| w.parse().ok()).collect();
    let named: Vec<&String> = words.iter().filter(|w| w.parse::<u64>().is_err()).collect();
    println!(
        "| family | valid | at once / restarted / refused / too long / WRONG | on the surface for a while | left inside | processor s | longest |"
    );
    println!("|---|---|---|---|---|---|---|");
    for (family, seeds, what) in FAMILIES {
        if named.is_empty() || named.iter().any(|name| *name == family) {
            let (from, to) =
                (numbers.first().copied().unwrap_or(0), numbers.get(1).copied().unwrap_or(seeds));
            run_family(family, what, from..to);
        }
    }
}

fn run_family(family: &str, what: &str, seeds: std::ops::Range<u64>) {
    let mut count = [0; 6];
    let (mut on_surface, mut inside, mut seconds, mut longest) = (0, 0, 0.0, (0.0, 0));
    for seed in seeds {
        let line = run_apart(family, seed);
        let words: Vec<&str> = line.split_whitespace().collect();
        let number = |i: usize| words.get(i).and_then(|w| w.parse::<f64>().ok()).unwrap_or(0.0);
        let kind = ["at-once", "restarted", "refused", "too-long", "invalid"];
        count[kind.iter().position(|k| words.first() == Some(k)).unwrap_or(5)] += 1;
        on_surface += number(5) as u64;
        inside += number(6) as u64;
        seconds += number(7);
        if number(7) > longest.0 {
            longest = (number(7), seed);
        }
        if words.first() != Some(&"at-once") && words.first() != Some(&"invalid") {
            eprintln!("{family} {seed}: {line}");
        }
    }
    let [at_once, restarted, refused, too_long, invalid, wrong] = count;
    let valid = count.iter().sum::<usize>() - invalid;
    println!(
        "| {family}: {what} | {valid} | {at_once} / {restarted} / {refused} / {too_long} / {wrong} | {on_surface} | {inside} | {seconds:.1} | {:.1} (seed {}) |",
        longest.0, longest.1
    );
}

/// Runs one surface in its own process and returns its output.
fn run_apart(family: &str, seed: u64) -> String {
    let program = std::env::current_exe().expect("this program");
    let mut child = Command::new(program)
        .args(["one", family, &seed.to_string()])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("this program runs");
    let began = Instant::now();
    while child.try_wait().expect("a child").is_none() {
        if began.elapsed() > LIMIT {
            child.kill().expect("a child that runs");
            drop(child.wait());
            return format!("too-long - - - - 0 0 {}", LIMIT.as_secs());
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    let output = child.wait_with_output().expect("a child");
    let last = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim().lines().last().unwrap_or("").to_string();
    if output.status.success() {
        last(&output.stdout)
    } else {
        format!("WRONG {}", String::from_utf8_lossy(&output.stderr).replace('\n', " "))
    }
}

/// Fills one surface and checks it.
///
/// Returns the result, triangles, missing edges and faces, restarts, points on the surface and
/// inside, seconds.
fn fill(family: &str, seed: u64) -> String {
    let mut random = Random::new(seed);
    let mut soup = make(family, &mut random);
    let turn = Rotation3::from_euler_angles(7.0 * random.unit(), 7.0 * random.unit(), 7.0 * random.unit());
    if !seed.is_multiple_of(3) {
        soup.map(|p| turn * p);
    }
    if seed % 3 == 2 {
        let size = soup.points.iter().map(|p| p.coords.norm()).fold(0.0, f64::max);
        let away = Vector::new(random.unit(), random.unit(), random.unit()) * (AWAY * size);
        soup.map(|p| p + away);
    }
    let Ok(surface) = soup.surface() else { return "invalid".to_string() };
    let began = cpu_seconds();
    let settings = Settings { fill: false, ..Settings::default() };
    let filled = mesh(&surface, &UniformSize(f64::INFINITY), &settings);
    let seconds = cpu_seconds() - began;
    let triangles = surface.triangles().len();
    match filled {
        Ok((mesh, report)) => {
            check_fills(&surface, &mesh);
            let kind = if report.restarts == 0 { "at-once" } else { "restarted" };
            format!(
                "{kind} {triangles} {} {} {} {} {} {seconds:.2}",
                report.missing_edges,
                report.missing_faces,
                report.restarts,
                report.steiner_on_surface,
                report.steiner_inside
            )
        }
        Err(error) => format!("refused {triangles} - - - 0 0 {seconds:.2} {error}"),
    }
}

/// Makes a surface of a family.
fn make(family: &str, random: &mut Random) -> Soup {
    match family {
        "prisms" => prism([3, 14], [1, 4], random),
        "many-prisms" => prism([15, 100], [1, 2], random),
        "blocks" => notched_block(whole(random, 1, 6) as usize, power(random, -4.0, 0.0)),
        "many-blocks" => notched_block(whole(random, 7, 40) as usize, power(random, -4.0, 0.0)),
        "skins" => {
            let squeeze = [0, 1, 2].map(|_| power(random, -1.0, 0.5));
            let (n, shear, bend) = (whole(random, 1, 3), 2.0 * random.unit(), random.unit());
            let (pieces, kinds) = (whole(random, 1, 3), u64::from(whole(random, 2, 4)));
            lattice_skin(n, squeeze, shear, bend, pieces, || body(random.bits() % kinds))
        }
        "staircases" => {
            let (n, shift, kinds) =
                (whole(random, 2, 4), 0.1 * random.unit(), u64::from(whole(random, 2, 4)));
            staircase(n, shift, random, |random| body(random.bits() % kinds))
        }
        "grids" => {
            let (n, kinds) = (whole(random, 2, 4), u64::from(whole(random, 2, 4)));
            let mut soup = staircase(n, 0.0, random, |random| body(random.bits() % kinds));
            let places = [0; 3].map(|_| {
                let mut at = vec![0.0];
                (0..n).for_each(|i| at.push(at[i as usize] + power(random, -8.5, 0.0)));
                at
            });
            soup.map(|p| [0, 1, 2].map(|k| places[k][p[k] as usize]).into());
            soup
        }
        "lenses" | "thin-lenses" => {
            let n = whole(random, 2, 14) as usize;
            let gap = if family == "lenses" { power(random, -8.5, 0.0) } else { 3e-9 };
            lens(n, gap, (random.unit() * 8.0) as usize * n * n, random)
        }
        "spikes" => {
            let (levels, reach) = (whole(random, 0, 3), power(random, 0.1, 4.0));
            let outer = random.unit() < 0.5;
            spiked_ball(levels, reach, 60 << (2 * levels), outer, random)
        }
        "shells" => shells(random),
        "needles" => {
            let (sides, aspect) = (whole(random, 3, 200), power(random, 1.0, 5.0));
            if random.unit() < 0.5 {
                needle_cone(sides, aspect)
            } else {
                needle_tube(sides, aspect, power(random, -5.0, -0.3))
            }
        }
        other => panic!("no family {other}"),
    }
}

fn prism(sides: [u32; 2], layers: [u32; 2], random: &mut Random) -> Soup {
    let sides = whole(random, sides[0], sides[1]);
    let layers = whole(random, layers[0], layers[1]);
    let twist = 1.0 - power(random, -3.0, -0.2);
    twisted_prisms(sides, -twist * twist_limit(sides), power(random, -0.5, 0.5), layers)
}

/// Two or three nested balls, flattened alike.
fn shells(random: &mut Random) -> Soup {
    let (levels, flat) = (whole(random, 1, 3), power(random, -4.0, 0.5));
    let mut soup = Soup::default();
    let mut radius = 1.0;
    let count = whole(random, 2, 3);
    for i in 0..count {
        let inner = if i + 1 == count { None } else { Some(BodyId(i + 1)) };
        // Outermost first: behind each is a body, behind the last possibly a hole.
        let outer = if i == 0 { None } else { Some(BodyId(i)) };
        soup.sphere(tetmill::Point::origin(), radius, levels, [inner, outer]);
        radius *= 1.0 - power(random, -8.0, -0.3);
    }
    soup.map(|p| tetmill::Point::new(p.x + 0.3 * p.z, p.y, p.z * flat));
    soup
}

fn body(kind: u64) -> Option<BodyId> {
    [A, None, B, Some(BodyId(2))][kind as usize]
}

/// An integer from `low` to `high`.
fn whole(random: &mut Random, low: u32, high: u32) -> u32 {
    low + (random.bits() % u64::from(high - low + 1)) as u32
}

/// A power of ten with an exponent between two.
fn power(random: &mut Random, low: f64, high: f64) -> f64 {
    10f64.powf(low + (high - low) * random.unit())
}
