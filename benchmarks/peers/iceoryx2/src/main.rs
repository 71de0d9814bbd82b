// SPDX-License-Identifier: MIT
//! mpf-bench-iceoryx2: iceoryx2 as a peer of `mpf bench local`. The protocol is in
//! benchmarks/README.md, "Add a peer in another language".
//!
//!   mpf-bench-iceoryx2 request-response|publish-subscribe role=server work=round-trips ...
//!
//! spin: both sides poll. block: the receiver sleeps at a listener of iceoryx2, which the sender
//! notifies after each message.

mod publish_subscribe;
mod request_response;
mod setup;
mod stopwatch;
mod timing;

use publish_subscribe::Pair;
use request_response::RequestingClient;
use setup::{Failure, Options};
use timing::Requester;

/// The runner closes the standard input at the end of the row, and removes the files.
fn end_with_standard_input() {
    std::thread::spawn(|| {
        let _ = std::io::copy(&mut std::io::stdin(), &mut std::io::sink());
        std::process::exit(0);
    });
}

fn measure(peer: &mut impl Requester, options: &Options) -> Result<(), Failure> {
    let (warm_up_ns, measure_ns) = (options.number("warmUpNs")?, options.number("measureNs")?);
    match options.text("work")? {
        "round-trips" => timing::round_trips(peer, warm_up_ns, measure_ns)?,
        "outstanding" => {
            let window = options.number("window")? as usize;
            timing::outstanding(peer, window, warm_up_ns, measure_ns)
        }
        other => return Err(format!("work={other} is unknown").into()),
    }
    Ok(())
}

fn run(pattern: &str, options: &Options) -> Result<(), Failure> {
    let is_server = options.text("role")? == "server";
    let publishes = pattern == "publish-subscribe";
    match (options.text("work")?, is_server) {
        ("one-way", true) => publish_subscribe::flood(options),
        ("one-way", false) => publish_subscribe::drain(options),
        (_, true) if publishes => Pair::serve(options),
        (_, true) => request_response::serve(options),
        (_, false) if publishes => measure(&mut Pair::connect(options)?, options),
        (_, false) => measure(&mut RequestingClient::connect(options)?, options),
    }
}

fn main() {
    let mut words = std::env::args().skip(1);
    let pattern = words.next().unwrap_or_default();
    end_with_standard_input();
    if let Err(failure) = run(&pattern, &Options::new(words.collect())) {
        eprintln!("{failure}");
        std::process::exit(1);
    }
}
