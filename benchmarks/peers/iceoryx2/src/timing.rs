// SPDX-License-Identifier: MIT
//! The loops of the requester, which are those of benchmarks/stage/timing.h, and its report.

use crate::stopwatch::{start, stop, Stopwatch};
use std::io::Write;
use std::time::{Duration, Instant};

/// What a peer does in a measurement.
pub trait Requester {
    fn send(&mut self);
    fn receive(&mut self);
}

/// Log-linear buckets: exact below 256 ns, then 128 buckets for each power of two.
struct Histogram {
    buckets: Vec<u64>,
}

impl Histogram {
    fn new() -> Self {
        Histogram { buckets: vec![0; 256 + 32 * 128] }
    }

    fn add(&mut self, ns: u64) {
        let index = if ns < 256 {
            ns
        } else {
            let shift = 64 - ns.leading_zeros() as u64 - 8;
            shift * 128 + (ns >> shift)
        };
        let last = self.buckets.len() - 1;
        self.buckets[(index as usize).min(last)] += 1;
    }

    fn upper_ns(index: u64) -> u64 {
        if index < 256 {
            return index;
        }
        let shift = index / 128 - 1;
        ((index % 128 + 129) << shift) - 1
    }

    fn median(&self) -> u64 {
        let half = self.buckets.iter().sum::<u64>() / 2;
        let mut seen = 0;
        let found = self.buckets.iter().position(|count| {
            seen += count;
            seen > half
        });
        Self::upper_ns(found.unwrap_or(0) as u64)
    }

    fn report(&self, max_ns: u64, out: &mut impl Write) -> std::io::Result<()> {
        let used = self.buckets.iter().enumerate().filter(|(_, count)| **count > 0);
        for (index, count) in used {
            writeln!(out, "latency {} {}", Self::upper_ns(index as u64).min(max_ns), count)?;
        }
        Ok(())
    }
}

fn median_of_groups(watch: &Stopwatch, measure_ns: u64, about_ns: f64, mut step: impl FnMut()) -> f64 {
    let per_group = (20_000.0 / about_ns.max(1.0)).clamp(1.0, 100.0) as u64;
    let mut groups = Vec::with_capacity(1 << 16);
    let end = start() + watch.ticks_of(measure_ns);
    loop {
        let from = start();
        for _ in 0..per_group {
            step();
        }
        let now = stop();
        groups.push(watch.elapsed_ns(from, now) / per_group as f64);
        if now >= end || groups.len() == groups.capacity() {
            break;
        }
    }
    groups.sort_by(f64::total_cmp);
    groups[groups.len() / 2]
}

/// Half of the time each round trip is timed, the other half in groups.
pub fn round_trips(peer: &mut impl Requester, warm_up_ns: u64, measure_ns: u64) -> std::io::Result<()> {
    let watch = Stopwatch::new();
    let mut round_trip = || {
        peer.send();
        peer.receive();
    };
    let warm = start() + watch.ticks_of(warm_up_ns);
    while start() < warm {
        round_trip();
    }
    let mut histogram = Histogram::new();
    let mut max_ns = 0;
    let end = start() + watch.ticks_of(measure_ns / 2);
    loop {
        let from = start();
        round_trip();
        let now = stop();
        let ns = watch.elapsed_ns(from, now).round() as u64;
        histogram.add(ns);
        max_ns = max_ns.max(ns);
        if now >= end {
            break;
        }
    }
    let typical = median_of_groups(&watch, measure_ns / 2, histogram.median() as f64, round_trip);
    let mut out = std::io::BufWriter::new(std::io::stdout().lock());
    writeln!(out, "typical {typical}")?;
    histogram.report(max_ns, &mut out)?;
    out.flush()
}

/// Calls `step`, which completes one message, repeatedly.
pub fn rate(mut step: impl FnMut(), warm_up_ns: u64, measure_ns: u64) {
    let warm = Instant::now() + Duration::from_nanos(warm_up_ns);
    while Instant::now() < warm {
        step();
    }
    let from = Instant::now();
    let measure = Duration::from_nanos(measure_ns);
    let mut steps: u64 = 0;
    while from.elapsed() < measure {
        for _ in 0..64 {
            step();
        }
        steps += 64;
    }
    println!("rate {} {}", steps, from.elapsed().as_nanos());
}

/// Keeps `window` requests outstanding.
pub fn outstanding(peer: &mut impl Requester, window: usize, warm_up_ns: u64, measure_ns: u64) {
    for _ in 0..window {
        peer.send();
    }
    rate(
        || {
            peer.receive();
            peer.send();
        },
        warm_up_ns,
        measure_ns,
    );
}
