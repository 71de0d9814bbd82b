// SPDX-License-Identifier: MIT
//! The options of this program, and what both patterns need: a node with files of its own, a
//! bell in each direction, memory that is read and written.

use iceoryx2::port::listener::Listener;
use iceoryx2::port::notifier::Notifier;
use iceoryx2::prelude::*;
use std::error::Error;
use std::time::Duration;

pub type Failure = Box<dyn Error>;
pub type IpcNode = Node<ipc::Service>;

/// Room for the requests that are outstanding, and for one-way messages.
pub const ROOM: usize = 256;

/// The protocol of the runner: words "key=value".
#[derive(Clone)]
pub struct Options {
    words: Vec<String>,
}

impl Options {
    pub fn new(words: Vec<String>) -> Self {
        Options { words }
    }

    pub fn text(&self, key: &str) -> Result<&str, Failure> {
        let found = self.words.iter().find_map(|word| word.strip_prefix(key)?.strip_prefix('='));
        found.ok_or_else(|| format!("{key}= is missing").into())
    }

    pub fn number(&self, key: &str) -> Result<u64, Failure> {
        self.text(key)?.parse().map_err(|_| format!("{key}= is not a number").into())
    }

    pub fn bytes(&self) -> Result<usize, Failure> {
        Ok(self.number("bytes")? as usize)
    }

    pub fn touches(&self) -> Result<bool, Failure> {
        Ok(self.number("touch")? == 1)
    }

    pub fn service(&self, what: &str) -> Result<ServiceName, Failure> {
        Ok(format!("{}/{}", self.text("name")?, what).as_str().try_into()?)
    }
}

/// All files of the node begin with the name that the runner removes after a failure.
pub fn create_node(options: &Options) -> Result<IpcNode, Failure> {
    let name = options.text("name")?;
    let mut config = Config::default();
    config.global.prefix = FileName::new(format!("{name}.").as_bytes())?;
    config.global.set_root_path(&Path::new(format!("/tmp/{name}.ix").as_bytes())?);
    set_log_level(LogLevel::Error);
    Ok(NodeBuilder::new().config(&config).create::<ipc::Service>()?)
}

/// One direction: the sender rings, the receiver sleeps until it rings. Without one, both poll.
pub struct Bells {
    rings: Option<(Notifier<ipc::Service>, Listener<ipc::Service>)>,
}

impl Bells {
    /// Both processes call this; `mine` is what this process waits for.
    pub fn open(node: &IpcNode, options: &Options, mine: &str, other: &str) -> Result<Self, Failure> {
        if options.text("mode")? == "spin" {
            return Ok(Bells { rings: None });
        }
        let bell = |what: &str| -> Result<_, Failure> {
            Ok(node.service_builder(&options.service(what)?).event().open_or_create()?)
        };
        let listener = bell(mine)?.listener_builder().create()?;
        let notifier = bell(other)?.notifier_builder().create()?;
        Ok(Bells { rings: Some((notifier, listener)) })
    }

    #[inline(always)]
    pub fn ring(&self) {
        if let Some((notifier, _)) = &self.rings {
            notifier.notify().expect("notify");
        }
    }

    /// Waits for 100 ms at most, because iceoryx2 0.10.0 can lose a notification (Waiter and
    /// Handle::notify in event/common.rs of iceoryx2-cal): after a listener has emptied the buffer
    /// of a notifier that is between its write and its state NOTIFIED, the listener sleeps, and
    /// later notifications write nothing.
    #[inline(always)]
    pub fn wait(&self) {
        match &self.rings {
            None => core::hint::spin_loop(),
            Some((_, listener)) => {
                listener.timed_wait(|_| {}, Duration::from_millis(100)).expect("timed_wait");
            }
        }
    }
}

/// Writes every byte.
pub fn write_all(to: &mut [u8]) {
    use std::sync::atomic::{AtomicU8, Ordering};
    static VALUE: AtomicU8 = AtomicU8::new(0);
    to.fill(VALUE.fetch_add(1, Ordering::Relaxed));
}

/// Reads every byte.
pub fn read_all(from: &[u8]) {
    let mut lanes = [0u64; 8];
    let mut blocks = from.chunks_exact(64);
    for block in &mut blocks {
        for (lane, word) in lanes.iter_mut().zip(block.chunks_exact(8)) {
            *lane = lane.wrapping_add(u64::from_le_bytes(word.try_into().unwrap()));
        }
    }
    let rest: u64 = blocks.remainder().iter().map(|byte| *byte as u64).sum();
    std::hint::black_box(lanes.iter().fold(rest, |sum, lane| sum.wrapping_add(*lane)));
}
