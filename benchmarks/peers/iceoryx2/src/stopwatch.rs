// SPDX-License-Identifier: MIT
//! The counter of the processor, as in benchmarks/stage/stopwatch.h: fences keep the measured
//! instructions inside the interval, and the cost of reading is subtracted.

use std::time::{Duration, Instant};

pub struct Stopwatch {
    ns_per_tick: f64,
    cost_ns: f64,
}

#[cfg(target_arch = "x86_64")]
#[inline(always)]
pub fn start() -> u64 {
    unsafe {
        core::arch::x86_64::_mm_lfence();
        core::arch::x86_64::_rdtsc()
    }
}

#[cfg(target_arch = "x86_64")]
#[inline(always)]
pub fn stop() -> u64 {
    unsafe {
        let mut cpu = 0;
        let ticks = core::arch::x86_64::__rdtscp(&mut cpu);
        core::arch::x86_64::_mm_lfence();
        ticks
    }
}

#[cfg(not(target_arch = "x86_64"))]
pub fn start() -> u64 {
    static BEGIN: std::sync::OnceLock<Instant> = std::sync::OnceLock::new();
    BEGIN.get_or_init(Instant::now).elapsed().as_nanos() as u64
}

#[cfg(not(target_arch = "x86_64"))]
pub fn stop() -> u64 {
    start()
}

impl Stopwatch {
    pub fn new() -> Self {
        let begin = Instant::now();
        let from = start();
        while begin.elapsed() < Duration::from_millis(5) {}
        let ns_per_tick = begin.elapsed().as_nanos() as f64 / (stop() - from) as f64;
        let mut watch = Stopwatch { ns_per_tick, cost_ns: 0.0 };
        const READINGS: u64 = 1000;
        let least = (0..8)
            .map(|_| {
                let from = start();
                for _ in 1..READINGS {
                    stop();
                    start();
                }
                watch.to_ns(stop() - from) / READINGS as f64
            })
            .fold(f64::MAX, f64::min);
        watch.cost_ns = least / 2.0; // half of the cost is inside an interval
        watch
    }

    fn to_ns(&self, ticks: u64) -> f64 {
        ticks as f64 * self.ns_per_tick
    }

    pub fn elapsed_ns(&self, from: u64, to: u64) -> f64 {
        (self.to_ns(to - from) - self.cost_ns).max(0.0)
    }

    pub fn ticks_of(&self, ns: u64) -> u64 {
        (ns as f64 / self.ns_per_tick) as u64
    }
}
