// SPDX-License-Identifier: MIT
//! Request-response with slices that are loaned, as in the benchmark of iceoryx2.

use crate::setup::{create_node, read_all, write_all, Bells, Failure, Options};
use crate::timing::Requester;
use iceoryx2::pending_response::PendingResponse;
use iceoryx2::port::client::Client;
use iceoryx2::prelude::*;
use std::collections::VecDeque;

type Pending = PendingResponse<ipc::Service, [u8], (), [u8], ()>;

macro_rules! service {
    ($node:expr, $options:expr) => {
        $node
            .service_builder(&$options.service("requests")?)
            .request_response::<[u8], [u8]>()
            .max_active_requests_per_client($options.number("window")? as usize + 1)
            .max_loaned_requests(2)
            .max_clients(1)
            .max_servers(1)
            .enable_safe_overflow_for_requests(false)
            .enable_safe_overflow_for_responses(false)
            .open_or_create()?
    };
}

pub fn serve(options: &Options) -> Result<(), Failure> {
    let node = create_node(options)?;
    let (bytes, touches) = (options.bytes()?, options.touches()?);
    let service = service!(node, options);
    let server = service.server_builder().initial_max_slice_len(bytes).create()?;
    let bells = Bells::open(&node, options, "to-server", "to-client")?;
    println!("ready");
    loop {
        let Some(request) = server.receive()? else {
            bells.wait();
            continue;
        };
        let mut response = unsafe { request.loan_slice_uninit(bytes)?.assume_init() };
        if touches {
            read_all(request.payload());
            write_all(response.payload_mut());
        }
        response.send()?;
        bells.ring();
    }
}

pub struct RequestingClient {
    client: Client<ipc::Service, [u8], (), [u8], ()>,
    bells: Bells,
    pending: VecDeque<Pending>,
    bytes: usize,
    touches: bool,
}

impl RequestingClient {
    pub fn connect(options: &Options) -> Result<Self, Failure> {
        let node = create_node(options)?;
        let bytes = options.bytes()?;
        let service = service!(node, options);
        let client = service.client_builder().initial_max_slice_len(bytes).create()?;
        let bells = Bells::open(&node, options, "to-client", "to-server")?;
        let touches = options.touches()?;
        Ok(RequestingClient { client, bells, pending: VecDeque::new(), bytes, touches })
    }
}

impl Requester for RequestingClient {
    fn send(&mut self) {
        let loaned = self.client.loan_slice_uninit(self.bytes).expect("loan of a request");
        let mut request = unsafe { loaned.assume_init() };
        if self.touches {
            write_all(request.payload_mut());
        }
        self.pending.push_back(request.send().expect("send of a request"));
        self.bells.ring();
    }

    fn receive(&mut self) {
        let oldest = self.pending.pop_front().expect("an outstanding request");
        loop {
            if let Some(response) = oldest.receive().expect("receive of a response") {
                if self.touches {
                    read_all(response.payload());
                }
                return;
            }
            self.bells.wait();
        }
    }
}
