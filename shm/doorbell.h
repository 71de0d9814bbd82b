// SPDX-License-Identifier: MIT
// Doorbell: how a window's owner sleeps and how its peers wake it.
//
//   owner   sleeping = 1       ─ fence ─ look again ─ sleep on the bell ─ sleeping = 0
//   peer    publish a message  ─ fence ─ sleeping? ─ change the bell, wake
//
// The two fences ensure that at least one side sees the other: either the owner finds the message,
// or the peer sees that the owner sleeps.
//
// Threads  one owner thread; any number of threads of any process ring.
// Crash    a peer that is killed between publishing and waking leaves a message without a wake-up.
//          The owner is notified of the peer's death and then finds the message.
// Trust    a peer may ring without a message. No process can prevent another one from ringing.
#pragma once

#include <atomic>
#include <string>

#include <mpf/clock.h>
#include <mpf/file_descriptor.h>

#include "shm/layout.h"

namespace mpf::doorbell {

// Orders the caller's stores before the fence with its loads after the fence. One half of
// PAIR(sleep-fence) and PAIR(watch-fence).
inline void fence() noexcept {
#ifdef __SANITIZE_THREAD__
  // ThreadSanitizer does not model fences. A locked instruction is a full fence on the hosts that
  // ThreadSanitizer supports.
  static std::atomic<std::uint32_t> anywhere{0};
  // PAIR(sleep-fence), PAIR(watch-fence): see the comments of the callers.
  anywhere.fetch_add(1, std::memory_order_seq_cst);
#else
  // PAIR(sleep-fence), PAIR(watch-fence): see the comments of the callers.
  std::atomic_thread_fence(std::memory_order_seq_cst);
#endif
}

// Sleeps while `bell` has the value `seen`, until a ring or until `deadline`. May return earlier:
// for example when a signal handler ran that was installed without SA_RESTART. A handler that must
// end the sleep rings the bell.
void sleep(const layout::Word32& bell, std::uint32_t seen, Deadline deadline) noexcept;

// Changes the bell and wakes the thread that sleeps on it.
void ring(layout::Word32& bell) noexcept;

// The doorbell of an event loop: a FIFO in /dev/shm that is readable after a ring.
//   group   ~0: the group of the process
//   throws  std::system_error
FileDescriptor createFifo(const std::string& name, mode_t mode, std::uint32_t group);
// Returns an empty descriptor if there is no FIFO of this name or it cannot be opened.
FileDescriptor tryOpenFifo(const std::string& name) noexcept;
// Returns false if `fifo` is empty or cannot be written: nothing was rung.
bool tryRingFifo(const FileDescriptor& fifo) noexcept;
// Empties the FIFO, unless peers fill it as fast: then it stays readable.
void drainFifo(const FileDescriptor& fifo) noexcept;

}  // namespace mpf::doorbell
