// SPDX-License-Identifier: MIT
//! Publish-subscribe: one service in each direction for round trips, one for one-way messages.

use crate::setup::{create_node, read_all, write_all, Bells, Failure, IpcNode, Options, ROOM};
use crate::timing::{rate, Requester};
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::*;
use iceoryx2::service::port_factory::publish_subscribe::PortFactory as TopicFactory;

type Service = TopicFactory<ipc::Service, [u8], ()>;

fn open(node: &IpcNode, options: &Options, what: &str) -> Result<Service, Failure> {
    let service = node
        .service_builder(&options.service(what)?)
        .publish_subscribe::<[u8]>()
        .enable_safe_overflow(false)
        .history_size(0)
        .subscriber_max_buffer_size(ROOM)
        .max_publishers(1)
        .max_subscribers(1)
        .open_or_create()?;
    Ok(service)
}

fn publisher(service: &Service, bytes: usize) -> Result<Publisher<ipc::Service, [u8], ()>, Failure> {
    let builder = service.publisher_builder().initial_max_slice_len(bytes);
    Ok(builder.backpressure_strategy(BackpressureStrategy::RetryUntilDelivered).create()?)
}

/// Both ends of a pair: it sends in one direction and receives in the other.
pub struct Pair {
    out: Publisher<ipc::Service, [u8], ()>,
    back: Subscriber<ipc::Service, [u8], ()>,
    bells: Bells,
    bytes: usize,
    touches: bool,
}

impl Pair {
    fn open(options: &Options, out: &str, back: &str) -> Result<Self, Failure> {
        let node = create_node(options)?;
        let bytes = options.bytes()?;
        Ok(Pair {
            out: publisher(&open(&node, options, out)?, bytes)?,
            back: open(&node, options, back)?.subscriber_builder().create()?,
            bells: Bells::open(&node, options, &format!("bell-{back}"), &format!("bell-{out}"))?,
            bytes,
            touches: options.touches()?,
        })
    }

    pub fn connect(options: &Options) -> Result<Self, Failure> {
        Self::open(options, "requests", "replies")
    }

    pub fn serve(options: &Options) -> Result<(), Failure> {
        let mut pair = Self::open(options, "replies", "requests")?;
        println!("ready");
        loop {
            pair.receive();
            pair.send();
        }
    }
}

impl Requester for Pair {
    fn send(&mut self) {
        let loaned = self.out.loan_slice_uninit(self.bytes).expect("loan of a sample");
        let mut sample = unsafe { loaned.assume_init() };
        if self.touches {
            write_all(sample.payload_mut());
        }
        sample.send().expect("send of a sample");
        self.bells.ring();
    }

    fn receive(&mut self) {
        loop {
            if let Some(sample) = self.back.receive().expect("receive of a sample") {
                if self.touches {
                    read_all(sample.payload());
                }
                return;
            }
            self.bells.wait();
        }
    }
}

/// One way: the server publishes as fast as the requester takes samples.
pub fn flood(options: &Options) -> Result<(), Failure> {
    let node = create_node(options)?;
    let bytes = options.bytes()?;
    let service = open(&node, options, "flood")?;
    let publisher = publisher(&service, bytes)?;
    let bells = Bells::open(&node, options, "unused", "flooded")?;
    println!("ready");
    while service.dynamic_config().number_of_subscribers() == 0 {
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    loop {
        let sample = unsafe { publisher.loan_slice_uninit(bytes)?.assume_init() };
        sample.send()?;
        bells.ring();
    }
}

pub fn drain(options: &Options) -> Result<(), Failure> {
    let node = create_node(options)?;
    let bells = Bells::open(&node, options, "flooded", "unused")?;
    let subscriber = open(&node, options, "flood")?.subscriber_builder().create()?;
    let take = || loop {
        if subscriber.receive().expect("receive of a sample").is_some() {
            return;
        }
        bells.wait();
    };
    rate(take, options.number("warmUpNs")?, options.number("measureNs")?);
    Ok(())
}
