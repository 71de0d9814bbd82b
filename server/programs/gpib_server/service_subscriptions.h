// SPDX-License-Identifier: MIT
// ServiceSubscriptions: tells clients of a GPIB server that an instrument requests service, as
// described in include/mpf/gpib_commands.h.
//
//   SRQ ──► bus ──► requested(), pollInstruments() ── serial polls ──► report() ──► OutOfBand
//                                     a client's cmdSerialPoll ─────────┘           messages
//
// The bus watches the SRQ line while there are subscriptions. When none of the instruments that
// are polled requests service, the next polls come later and later, up to a second: another
// instrument may hold the line for hours.
//
// Threads  the server's thread adds and removes; the bus thread polls and reports.
// Trust    a client that does not receive its messages loses them; the next one counts them.
#pragma once

#include <atomic>
#include <functional>
#include <mutex>
#include <optional>
#include <vector>

#include <mpf/drivers/gpib/gpib_bus.h>
#include <mpf/message_server.h>

#include "server/programs/server_log.h"

namespace mpf {

class ServiceSubscriptions {
 public:
  //   server, bus, log  must outlive this
  //   pollTimeout       of one instrument
  //   requested         called when pollInstruments() has something to do, on a thread of the bus
  ServiceSubscriptions(MessageServer& server, GpibBus& bus, const ServerLog& log,
                       std::chrono::milliseconds pollTimeout, std::function<void()> requested);

  // Replies to `request` and begins its subscription.
  void add(Char8ArrayMessage&& request, GpibAddress address);
  // Ends the subscription of a client to one instrument, or to all.
  void remove(GpibUser client, std::optional<GpibAddress> address);
  void removeGone();

  // Polls the instruments with subscriptions if there was a service request. During a lease, those
  // to which its holder subscribes.
  //   holder  of a lease; 0: there is no lease
  void pollInstruments(GpibUser holder);
  // Tells subscribers if the status byte requests service.
  void report(GpibAddress address, std::uint8_t statusByte);

 private:
  struct Subscription {
    Char8ArrayMessage request;  // cmdSubscribe; the messages are further replies to it
    GpibUser client = 0;
    GpibAddress address;
    std::int32_t lost = 0;  // messages that are missing and not reported yet
  };

  [[nodiscard]] std::vector<GpibAddress> instrumentsOf(GpibUser holder) const;
  void send(Subscription& subscription, std::uint8_t statusByte);
  void watchLineIfNeeded();

  MessageServer& server_;
  GpibBus& bus_;
  const ServerLog& log_;
  const std::chrono::milliseconds pollTimeout_;
  const std::function<void()> requested_;
  mutable std::mutex mutex_;
  std::vector<Subscription> subscriptions_;  // under mutex_
  std::atomic<bool> isRequested_{false};
  // The server's thread; exists while there are subscriptions.
  std::optional<GpibBus::Subscription> line_;
  // The bus thread:
  GpibUser holder_ = 0;
  std::vector<GpibAddress> round_;  // still to be polled
  bool isFound_ = false;  // an instrument of this round requested service
  Deadline noPollsBefore_ = Deadline::atNs(0);
  std::chrono::milliseconds pause_{0};
};

}  // namespace mpf
